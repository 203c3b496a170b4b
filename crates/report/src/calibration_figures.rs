//! Figures of a calibration: residuals by component, their Allan deviation and autocorrelation, and the
//! estimates.

use obsdeg_calibration::Calibration;
use obsdeg_calibration::answer::{Estimated, PositionFit, ResidualSeries};
use obsdeg_calibration::answer::{ResidualDeviation, ResidualPoint};

use crate::figure::{BLACK, BLUE, Band, Curve, Figure, FigureError, GREEN, ORANGE, SKY, Stroke, grid};
use crate::figures::{File, line, picture};

/// Name of a record without its folder.
pub(crate) fn file_name(record: &str) -> &str {
    record.rsplit(['/', '\\']).next().filter(|name| !name.is_empty()).unwrap_or(record)
}

/// The figures of a calibration: residuals over time by component and record, with bands of three sigma;
/// their Allan deviation and autocorrelation; the estimates with three sigma.
///
/// # Errors
/// [`FigureError`].
pub fn calibration_figures(c: &Calibration) -> Result<Vec<File>, FigureError> {
    let mut files = Vec::new();
    for (k, record) in c.records.iter().enumerate() {
        let own: Vec<&ResidualSeries> = c.series.iter().filter(|s| s.record == record.name).collect();
        let end = if c.records.len() > 1 { format!("-{}", k + 1) } else { String::new() };
        let mut draw = |name: &str, title: &str, figure: &dyn Fn(&ResidualSeries) -> Figure| {
            let figures: Vec<Figure> = own.iter().map(|s| figure(s)).collect();
            let title = format!("{title}, {}", file_name(&record.name));
            files.extend(picture(&format!("{name}{end}"), grid(&figures, figures.len().min(2), &title))?);
            Ok::<_, FigureError>(())
        };
        draw("residuals", "Residuals", &|s| residual_figure(c, s))?;
        draw("allan", "Allan deviation of the residuals", &allan_figure)?;
        draw("whiteness", "Autocorrelation of the residuals", &whiteness_figure)?;
    }
    let figures = estimate_figures(c);
    files.extend(picture(
        "estimates",
        grid(&figures, figures.len().min(3), "Three sigma about the estimates"),
    )?);
    Ok(files)
}

/// Points of a series, split by position: no line crosses a slew.
fn by_position<'s>(series: &'s ResidualSeries, positions: &[&PositionFit]) -> Vec<&'s [ResidualPoint]> {
    // ends of positions are rounded to rows of the record, so only their starts decide
    let place = |p: &ResidualPoint| positions.iter().take_while(|q| q.start_s <= p.t_s).count();
    series.points.chunk_by(|a, b| place(a) == place(b)).collect()
}

/// The residuals of a component over time.
pub(crate) fn residual_figure(c: &Calibration, series: &ResidualSeries) -> Figure {
    let own: Vec<&PositionFit> = c.positions.iter().filter(|p| p.record == series.record).collect();
    let pieces = by_position(series, &own);
    let all = &series.points;
    let (first, last) = (all.first().map_or(0.0, |p| p.t_s), all.last().map_or(1.0, |p| p.t_s));
    let largest = all.iter().map(|p| p.residual.abs().max(3.0 * p.sigma)).fold(0.0, f64::max);
    let half = if largest > 0.0 { 1.15 * largest } else { 1.0 };
    let band = |piece: &&[ResidualPoint]| Band {
        color: SKY,
        points: piece.iter().map(|p| (p.t_s, -3.0 * p.sigma, 3.0 * p.sigma)).collect(),
    };
    let residuals = |(i, piece): (usize, &&[ResidualPoint])| {
        let label = if i == 0 { "residual, band of +-3 sigma" } else { "" };
        line(label, BLUE, Stroke::Solid, piece.iter().map(|p| (p.t_s, p.residual)).collect())
    };
    let zero = line("zero", BLACK, Stroke::Dotted, vec![(first, 0.0), (last, 0.0)]);
    Figure {
        title: format!("{}: measurement minus estimate", series.channel),
        x_label: "t [s]".into(),
        y_label: format!("residual [{}]", series.unit),
        bands: pieces.iter().map(band).collect(),
        lines: std::iter::once(zero).chain(pieces.iter().enumerate().map(residuals)).collect(),
        marks: own.iter().skip(1).map(|p| p.start_s).collect(),
        x_range: Some((first.min(0.0), last)),
        y_range: Some((-half, half)),
        ..Figure::default()
    }
}

/// The Allan deviation of the residuals of a component, beside that of white noise.
pub(crate) fn allan_figure(series: &ResidualSeries) -> Figure {
    let curve =
        |of: fn(&ResidualDeviation) -> f64| series.allan.iter().map(|p| (p.tau_s, 1e6 * of(p))).collect();
    Figure {
        title: format!("{}: Allan deviation", series.channel),
        x_label: "cluster time [s]".into(),
        y_label: format!("deviation [u{}]", series.unit),
        lines: vec![
            line("residuals", BLUE, Stroke::Solid, curve(|p| p.deviation)),
            line("white, of the assumed sigma", BLACK, Stroke::Dotted, curve(|p| p.white)),
        ],
        log: true,
        ..Figure::default()
    }
}

/// The autocorrelation of the residuals of a component, a bar per lag, with the band of independent
/// residuals.
pub(crate) fn whiteness_figure(series: &ResidualSeries) -> Figure {
    let lags = series.autocorrelation.len();
    let mut bars = vec![(0.5, 0.0)];
    for (k, r) in series.autocorrelation.iter().enumerate() {
        let x = k as f64 + 1.0;
        bars.extend([(x - 0.25, 0.0), (x - 0.25, *r), (x + 0.25, *r), (x + 0.25, 0.0)]);
    }
    let band = 1.96 / (series.count.max(1) as f64).sqrt();
    let last = lags as f64 + 0.5;
    let largest = series.autocorrelation.iter().fold(2.0 * band, |m, r| m.max(r.abs()));
    Figure {
        title: format!("{}: correlation of residuals", series.channel),
        x_label: "lag [measurements]".into(),
        y_label: "correlation".into(),
        bands: vec![Band { color: SKY, points: vec![(0.5, -band, band), (last, -band, band)] }],
        lines: vec![line("correlation, band of 95 % if independent", BLUE, Stroke::Solid, bars)],
        x_range: Some((0.5, last)),
        y_range: Some((-1.15 * largest, 1.15 * largest)),
        ..Figure::default()
    }
}

/// Bars of three sigma about the estimates by family: fitted, predicted, required. The names along x have the
/// estimates, since sigmas are small beside them.
pub(crate) fn estimate_figures(c: &Calibration) -> Vec<Figure> {
    let mut families: Vec<(String, Vec<&Estimated>)> = Vec::new();
    for e in c.quantities.iter().filter(|e| e.determined) {
        // names such as D_FX, GM_XY, psi_x (record 2)
        let name = e.name.split(' ').next().unwrap_or(&e.name);
        let family = name.trim_end_matches(['X', 'Y', 'Z', 'x', 'y', 'z']).trim_end_matches('_');
        match families.iter_mut().find(|f| f.0 == family) {
            Some((_, own)) => own.push(e),
            None => families.push((family.into(), vec![e])),
        }
    }
    for e in c.combinations.iter().filter(|e| e.determined) {
        families.push((e.name.clone(), vec![e]));
    }
    families.iter().map(|(family, own)| family_figure(family, own)).collect()
}

/// Label, colour and stroke of bars, their shift along x, and the sigma that they show.
type BarSeries = (&'static str, &'static str, Stroke, f64, fn(&Estimated) -> Option<f64>);

/// A bar from `low` to `high` at `at`, with ends.
fn bar(label: &str, color: &'static str, stroke: Stroke, at: f64, [low, high]: [f64; 2]) -> Curve {
    let points =
        [(at - 0.08, low), (at + 0.08, low), (at, low), (at, high), (at - 0.08, high), (at + 0.08, high)];
    line(label, color, stroke, points.to_vec())
}

/// Name and estimate, with decimals down to the second digit of sigma.
fn named(e: &Estimated) -> String {
    let Some((x, sigma)) = e.estimate.zip(e.sigma) else { return e.name.clone() };
    // two digits of sigma
    let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{} = {x:.decimals$}", e.name)
}

fn family_figure(family: &str, own: &[&Estimated]) -> Figure {
    let last = own.len() as f64 + 0.5;
    let mut lines = vec![line("", BLACK, Stroke::Dotted, vec![(0.5, 0.0), (last, 0.0)])];
    let kinds: [BarSeries; 3] = [
        ("+-3 sigma of the estimate (rescaled)", BLUE, Stroke::Solid, 0.0, |e| e.sigma_rescaled),
        ("+-3 predicted sigma", ORANGE, Stroke::Dashed, 0.2, |e| e.predicted_sigma),
        ("+-3 required sigma", GREEN, Stroke::DashDot, -0.2, |e| e.required_sigma),
    ];
    for (label, color, stroke, aside, sigma) in kinds {
        let mut label = label;
        for (i, e) in own.iter().enumerate() {
            let Some(sigma) = sigma(e).filter(|_| e.determined) else { continue };
            let (at, half) = (i as f64 + 1.0 + aside, 3.0 * sigma);
            lines.push(bar(std::mem::take(&mut label), color, stroke, at, [-half, half]));
        }
    }
    Figure {
        title: family.into(),
        y_label: format!("about the estimate [{}]", own[0].unit),
        lines,
        x_range: Some((0.5, last)),
        x_names: own.iter().map(|e| named(e)).collect(),
        ..Figure::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An estimate has two digits of its sigma.
    #[test]
    fn estimates_have_the_decimals_of_their_sigmas() {
        let e = |estimate: Option<f64>, sigma: Option<f64>| {
            let value = serde_json::json!({
                "name": "D_FX", "unit": "deg/h", "status": "observable", "degree": 1, "determined": true,
                "estimate": estimate, "sigma": sigma, "sigma_rescaled": sigma, "predicted_sigma": sigma,
                "held_factor": 1.0, "prior_shift": null, "prior_factor": null,
            });
            named(&serde_json::from_value(value).expect("an estimate"))
        };
        assert_eq!(e(Some(1.300_123), Some(0.002_78)), "D_FX = 1.3001");
        assert_eq!(e(Some(-5.0), Some(31.0)), "D_FX = -5");
        assert_eq!(e(None, None), "D_FX");
    }

    #[test]
    fn a_record_is_named_by_its_file() {
        for (path, name) in [
            ("/data/day 1/run.csv", "run.csv"),
            ("run.csv", "run.csv"),
            ("C:\\r\\a.csv", "a.csv"),
            ("-", "-"),
        ] {
            assert_eq!(file_name(path), name);
        }
    }

    /// Two positions with a slew from 20 to 40 s: their points are in separate lines.
    #[test]
    fn series_are_drawn_by_position() {
        let position = |start_s: f64, end_s: f64| PositionFit {
            record: "run.csv".into(),
            position: "p".into(),
            start_s,
            end_s,
            force_g: None,
            measurements: 2,
            chi_square: 1.0,
            degrees_of_freedom: 2.0,
            moves: None,
            loses: Vec::new(),
        };
        let series = ResidualSeries {
            record: "run.csv".into(),
            channel: "Z1".into(),
            unit: "g".into(),
            points: [0.0, 10.0, 20.0, 40.0, 50.0]
                .map(|t_s| ResidualPoint { t_s, residual: 1e-6, sigma: 1e-6 })
                .to_vec(),
            allan: Vec::new(),
            autocorrelation: Vec::new(),
            count: 5,
        };
        let positions = [position(0.0, 20.0), position(40.0, 60.0)];
        let pieces = by_position(&series, &positions.iter().collect::<Vec<_>>());
        assert_eq!(pieces.iter().map(|p| p.len()).collect::<Vec<_>>(), [3, 2]);
        assert_eq!(pieces[1][0].t_s, 40.0);
    }
}
