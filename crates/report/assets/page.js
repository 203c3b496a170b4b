// Every figure with curves becomes interactive: values under the pointer, zoom by dragging, curves on and off by the legend.
(() => {
  "use strict";
  const root = document.documentElement;
  root.classList.add("js");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const variable = (name) => getComputedStyle(root).getPropertyValue(name).trim();
  const made = [];
  const shown = (x) => (x == null ? "--" : Math.abs(x) >= 1e-3 && Math.abs(x) < 1e5 || x === 0 ? String(+x.toPrecision(4)) : x.toExponential(2));

  function plot(figure, spec) {
    const holder = figure.querySelector(".plot");
    holder.replaceChildren();
    const text = variable("--text");
    const line = variable("--line");
    const color = (c) => (c === "#000000" ? text : c);
    const axis = (label, log) => ({
      label, stroke: text, grid: { stroke: line, width: 0.5 }, ticks: { stroke: line }, size: 64,
      values: (u, marks) => marks.map((v) => (v == null ? "" : shown(v))),
      ...(log ? {} : { space: 60 }),
    });
    const scale = (log, range) => ({
      time: false, distr: log ? 3 : 1, ...(range && !log ? { range: (u, low, high) => (u.zoomed ? [low, high] : range) } : {}),
    });
    const options = {
      title: spec.title, width: Math.max(240, holder.clientWidth), height: 320,
      scales: { x: scale(spec.log_x, null), y: scale(spec.log_y, spec.y_range && !spec.log_y ? spec.y_range : null) },
      axes: [axis(spec.x, spec.log_x), axis(spec.y, spec.log_y)],
      series: [{ label: spec.x, value: (u, v) => shown(v) }].concat(spec.series.map((s) => ({
        label: s.label || "curve", stroke: color(s.color), width: s.width, dash: s.dash, spanGaps: true,
        points: { show: false }, value: (u, v) => shown(v),
      }))),
      bands: spec.bands.map((b) => ({ series: b.series, fill: b.color + "40" })),
      cursor: { drag: { x: true, y: false } },
      hooks: {
        draw: [(u) => {
          u.ctx.save();
          u.ctx.strokeStyle = line;
          u.ctx.setLineDash([3, 4]);
          for (const mark of spec.marks) {
            const x = Math.round(u.valToPos(mark, "x", true));
            if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) continue;
            u.ctx.beginPath();
            u.ctx.moveTo(x, u.bbox.top);
            u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
            u.ctx.stroke();
          }
          u.ctx.restore();
        }],
      },
    };
    return new uPlot(options, uPlot.join(spec.tables), holder);
  }

  for (const figure of document.querySelectorAll("figure.curves")) {
    const spec = JSON.parse(figure.querySelector("script").textContent);
    const entry = { figure, spec, plot: plot(figure, spec) };
    made.push(entry);
    new ResizeObserver(() => {
      const width = Math.max(240, figure.querySelector(".plot").clientWidth);
      if (Math.abs(width - entry.plot.width) > 1) entry.plot.setSize({ width, height: 320 });
    }).observe(figure);
  }
  dark.addEventListener("change", () => {
    for (const entry of made) {
      entry.plot.destroy();
      entry.plot = plot(entry.figure, entry.spec);
    }
  });
})();
