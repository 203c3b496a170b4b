// Every figure with curves becomes interactive: values under the pointer, zoom by dragging, curves on and off by the legend.
(() => {
  "use strict";
  const root = document.documentElement;
  root.classList.add("js");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const variable = (name) => getComputedStyle(root).getPropertyValue(name).trim();
  // the palette of pictures, in the colours of the page
  const names = {
    "#000000": "--text", "#0072B2": "--blue", "#56B4E9": "--sky", "#D55E00": "--orange", "#009E73": "--green", "#CC79A7": "--purple",
    "#E69F00": "--amber", "#999999": "--grey",
  };
  const made = [];
  const shown = (x) => (x == null ? "" : Math.abs(x) >= 1e-3 && Math.abs(x) < 1e5 || x === 0 ? String(+x.toPrecision(4)) : x.toExponential(2));

  function plot(figure, spec) {
    const holder = figure.querySelector(".plot");
    holder.replaceChildren();
    const text = variable("--text");
    const line = variable("--line");
    const color = (c) => (names[c.toUpperCase()] ? variable(names[c.toUpperCase()]) : c);
    const axis = (label, log, whole, space, along) => ({
      ...(whole ? { incrs: [1, 2, 5, 10, 20, 50] } : {}), label, stroke: text, grid: { stroke: line, width: 0.5 }, ticks: { stroke: line }, size: along ? 50 : (u, marks) => 20 + 8 * Math.max(4, ...(marks || []).map((m) => String(m).length)),
      values: (u, marks) => marks.map((v) => (v == null ? "" : shown(v))),
      ...(log ? {} : { space }),
    });
    const scale = (log, range) => ({
      time: false, distr: log ? 3 : 1, ...(range && !log ? { range: (u, low, high) => (u.zoomed ? [low, high] : range) } : {}),
    });
    const options = {
      title: spec.title, width: Math.max(240, holder.clientWidth), height: 320,
      scales: { x: scale(spec.log_x, null), y: scale(spec.log_y, spec.y_range && !spec.log_y ? spec.y_range : null) },
      axes: [axis(spec.x, spec.log_x, spec.orders, 60, true), axis(spec.y, spec.log_y, spec.orders, 28)],
      series: [{ label: spec.x, value: (u, v) => shown(v) }].concat(spec.series.map((s) => ({
        label: s.label, stroke: color(s.color), width: s.width, dash: s.dash,
        points: { show: false }, value: (u, v) => shown(v),
      }))),
      bands: spec.bands.map((b) => ({ series: b.series, fill: color(b.color) + "40" })),
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
    const plotted = new uPlot(options, uPlot.join(spec.tables), holder);
    const canvas = holder.querySelector("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-labelledby", figure.id + "-caption");
    legend(plotted, spec, color);
    return plotted;
  }

  // The legend shows lines as they are drawn, and is worked by keys too.
  function legend(plotted, spec, color) {
    plotted.root.querySelectorAll(".u-legend .u-series").forEach((row, i) => {
      const label = row.querySelector(".u-label");
      if (i === 0) return;
      const s = spec.series[i - 1];
      if (!s.label) {
        row.hidden = true;
        return;
      }
      const marker = row.querySelector(".u-marker");
      marker.style.border = "0";
      marker.style.background = "none";
      marker.innerHTML = '<svg width="100%" height="100%" aria-hidden="true"><line x1="0" y1="50%" x2="100%" y2="50%"/></svg>';
      const line = marker.querySelector("line");
      line.style.stroke = color(s.color);
      line.style.strokeDasharray = s.dash.map((d) => d * 0.75).join(" ");
      label.tabIndex = 0;
      label.setAttribute("role", "button");
      const shown = () => label.setAttribute("aria-pressed", String(!row.classList.contains("u-off")));
      shown();
      new MutationObserver(shown).observe(row, { attributeFilter: ["class"] });
      label.addEventListener("keydown", (e) => {
        if (e.key !== "Enter" && e.key !== " ") return;
        e.preventDefault();
        label.dispatchEvent(new MouseEvent("click", { bubbles: true }));
      });
    });
  }

  function make(figure) {
    const spec = JSON.parse(figure.querySelector("script").textContent);
    const entry = { figure, spec, plot: plot(figure, spec) };
    made.push(entry);
    new ResizeObserver(() => {
      const width = Math.max(240, figure.querySelector(".plot").clientWidth);
      if (Math.abs(width - entry.plot.width) > 1) entry.plot.setSize({ width, height: 320 });
    }).observe(figure);
  }
  // what is folded has no width: it is drawn when it is unfolded
  let waiting = [...document.querySelectorAll("figure.curves")];
  const unfolded = () => {
    const folded = (figure) => figure.closest("details:not([open])") !== null;
    waiting.filter((figure) => !folded(figure)).forEach(make);
    waiting = waiting.filter(folded);
  };
  unfolded();
  document.addEventListener("toggle", unfolded, true);
  // what is folded is opened for a link into it, and on paper
  const reveal = () => {
    for (let e = document.getElementById(location.hash.slice(1)); e; e = e.parentElement) if (e.matches("details")) e.open = true;
  };
  addEventListener("hashchange", reveal);
  reveal();
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    folded.forEach((d) => { d.open = true; });
  });
  addEventListener("afterprint", () => folded.forEach((d) => { d.open = false; }));
  dark.addEventListener("change", () => {
    for (const entry of made) {
      entry.plot.destroy();
      entry.plot = plot(entry.figure, entry.spec);
    }
  });
})();
