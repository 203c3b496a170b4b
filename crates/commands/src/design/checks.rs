//! Checks of the options of a search: values out of range, and options without effect.

use obsdeg_core::model::{Carry, Scheme};
use obsdeg_evidence::simulation::Conditions;

use super::options::{CHECKED, KEPT, POSITIONS, RESTARTS, Search};
use crate::arguments::check_whole;
use crate::problem::Problem;

/// Checks the numbers among the options of a search.
pub(super) fn check_values(a: &Search) -> Result<(), Problem> {
    match (a.positions, a.minimum) {
        (None, false) => {
            return Err(Problem::input(
                "nothing to search; expected --positions K, --minimum, or a scheme file with as many positions",
            ));
        }
        (Some(_), true) => {
            return Err(Problem::input("found --positions beside --minimum; expected one of them"));
        }
        _ => {}
    }
    if let Some([i, n]) = a.part.filter(|[i, n]| !(1..=*n).contains(i)) {
        return Err(Problem::input(format!("--part {i}/{n}: expected a part such as 2/7")));
    }
    if let Some(within) = a.within.filter(|x| !(0.0..=100.0).contains(x)) {
        return Err(Problem::input(format!("--within {within}: expected 0 to 100 percent")));
    }
    for k in a.positions.iter().chain(&a.front) {
        check_whole("--positions", *k as u64, &POSITIONS)?;
    }
    a.keep.map_or(Ok(()), |keep| check_whole("--keep", keep, &KEPT))?;
    a.restarts.map_or(Ok(()), |restarts| check_whole("--restarts", restarts, &RESTARTS))?;
    a.check.map_or(Ok(()), |blocks| check_whole("--check", blocks, &CHECKED))?;
    Ok(())
}

/// Refuses options that would have no effect; the message names the option that they need.
pub(super) fn idle(a: &Search, merged: bool, base: &Scheme, conditions: &Conditions) -> Result<(), Problem> {
    let (w, free) = (&a.wanted, a.candidates == "free");
    if a.minimum {
        idle_with_minimum(a)?;
    }
    let others = [
        ("--check", a.check.is_some() && !merged, "--merge with it, whose parts are checked"),
        ("--round", a.round.is_some() && !free, "--candidates free with it"),
        (
            "--within",
            a.within.is_some_and(|within| within > 0.0) && base.carry != Carry::Reset,
            "--carry reset with it, or --within 0, by which all sequences are searched",
        ),
        (
            "--within",
            a.within.is_some() && free,
            "given candidates with it; free attitudes are never all searched",
        ),
        (
            "--within",
            a.within.is_some_and(|within| within > 0.0) && (a.part.is_some() || merged),
            "a search that is not in parts; these are of all sequences, as with --within 0",
        ),
        (
            "--max-slew",
            w.max_slew.is_some() && conditions.slew_rate_deg_s.is_none(),
            "slews that take time, by --slew-rate or the file of --candidates",
        ),
        (
            "--azimuth-noise",
            a.measurement.given().any(|option| option == "--azimuth-noise") && !base.measured_azimuth,
            "a measured azimuth, by --measured-azimuth or the file of --candidates",
        ),
    ];
    match others.into_iter().find(|(_, idle, _)| *idle) {
        Some((option, _, needed)) => {
            Err(Problem::input(format!("{option} does nothing here: expected {needed}")))
        }
        None => Ok(()),
    }
}

/// Refuses options that concern a number of positions beside `--minimum`.
fn idle_with_minimum(a: &Search) -> Result<(), Problem> {
    let w = &a.wanted;
    let of_positions = [
        ("--keep", a.keep.is_some()),
        ("--restarts", a.restarts.is_some()),
        ("--within", a.within.is_some()),
        ("--refine", a.refine),
        ("--divide", a.divide),
        ("--front", !a.front.is_empty()),
        ("--round", a.round.is_some()),
        ("--max-degree", !w.max_degree.is_empty()),
        ("--immune", !w.immune.is_empty()),
        ("--criterion", w.criterion.is_some()),
        ("--meet", w.meet),
        ("--max-time", w.max_time.is_some()),
        ("--max-slew", w.max_slew.is_some()),
        ("--slew-rate", w.slew_rate.is_some()),
    ];
    let given = of_positions.into_iter().filter_map(|(option, given)| given.then_some(option));
    if let Some(option) = given.chain(a.measurement.given()).next() {
        return Err(Problem::input(format!(
            "{option} does nothing with --minimum, which asks what positions determine at all, by any \
             degree and with any noise; it is for --positions"
        )));
    }
    Ok(())
}
