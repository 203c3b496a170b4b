//! Start of a fit: first values, first noise and steps of the integration.

use nalgebra::DVector;
use obsdeg_core::system::{ModelError, StateStart, SystemModel};
use obsdeg_ekf::EkfError;
use obsdeg_evidence::system::{FilterState, Numeric};

use super::answer::SystemCalibrationError;
use super::data::ModelData;
use super::fit::size;

/// Most steps of integration over all rows, and for each row besides.
const STEPS: f64 = 50_000.0;

const STEPS_A_ROW: f64 = 50.0;

/// All filter states at the first start: values of the file, and 1 where it states none.
pub(super) fn first_start(model: &SystemModel, numeric: &Numeric<'_>) -> Result<DVector<f64>, ModelError> {
    let nominal = &model.simulation;
    let value = |(i, name): (usize, &String)| {
        let found = nominal.named(&nominal.values, name);
        let start = match numeric.states[i] {
            FilterState::State { i, .. } => &model.states[i].start,
            _ => &StateStart::Unknown,
        };
        match (found, start) {
            (Some(v), _) => Ok(v),
            (None, StateStart::Known) => Err(ModelError {
                what: format!("`{name}`"),
                message: "a known start without a value; expected one under [simulation.values]".into(),
                span: None,
            }),
            (None, _) => Ok(1.0),
        }
    };
    let base = numeric.names.iter().enumerate().map(value).collect::<Result<Vec<_>, _>>()?;
    let mut base = DVector::from_vec(base);
    numeric.set_known_starts(&mut base);
    Ok(base)
}

/// Noise by output at the first start, and true for each output whose noise is estimated.
pub(super) fn first_noise(model: &SystemModel, data: &ModelData) -> (Vec<f64>, Vec<bool>) {
    // a row without a sigma of its own needs one
    let bare = |j: usize| data.rows.iter().any(|r| r.outputs[j].is_some() && r.sigmas[j].is_none());
    let by_inputs = data.rows.iter().any(|r| r.inputs.iter().any(|(_, s)| *s > 0.0));
    let (mut noise, mut estimated) = (Vec::new(), Vec::new());
    for (j, (named, _)) in model.outputs.iter().enumerate() {
        let given = model.simulation.noise.get(&named.name).copied();
        let unknown = given.is_none() && bare(j) && !by_inputs;
        estimated.push(unknown);
        let spread = spread(data.rows.iter().filter_map(|r| r.outputs[j]));
        noise.push(given.unwrap_or(if unknown { spread } else { 0.0 }));
    }
    (noise, estimated)
}

/// Longest step of integration, and the number of steps over all rows.
///
/// # Errors
/// [`SystemCalibrationError::TooLong`], before the work begins.
pub(super) fn integration_steps(
    model: &SystemModel,
    data: &ModelData,
) -> Result<(f64, f64), SystemCalibrationError> {
    let last = data.rows.iter().map(|r| r.t).fold(0.0, f64::max);
    let usual = if last > 0.0 { last / 50.0 } else { 1.0 };
    let longest = model.simulation.step.unwrap_or(f64::INFINITY).min(usual);
    let mut found = 0.0;
    for run in data.rows.chunk_by(|a, b| (a.experiment, a.run) == (b.experiment, b.run)) {
        let steps = |from: f64, to: f64| ((to - from) / longest).ceil().max(1.0);
        found += steps(0.0, run[0].t) + run.windows(2).map(|w| steps(w[0].t, w[1].t)).sum::<f64>();
    }
    let most = STEPS + STEPS_A_ROW * data.rows.len() as f64;
    if !model.states.is_empty() && found > most {
        let record = data.name.clone();
        return Err(SystemCalibrationError::TooLong { record, last, found, longest, most });
    }
    Ok((longest, found))
}

/// Error of `starts` from which the model gives no numbers.
pub(super) fn nowhere(starts: usize) -> impl Fn(EkfError) -> SystemCalibrationError {
    move |reason| SystemCalibrationError::Nowhere { starts, reason }
}

/// Name of an unknown without its experiment.
pub(super) fn plain(name: &str) -> &str {
    name.split_once('@').map_or(name, |(n, _)| n)
}

/// First estimate of the noise of an output: a tenth of its standard deviation.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    let square = values.map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    if square > 0.0 { 0.1 * square.sqrt() } else { 0.1 * size(mean) }
}
