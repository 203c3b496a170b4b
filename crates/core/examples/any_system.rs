//! Any system: a predator-prey model of which only the prey are counted. The example prints which of the
//! four rates and of the two populations the counts determine.
#![allow(clippy::print_stdout, reason = "an example")]

use obsdeg_core::system::{ModelError, SystemOptions, analyze_system, model_file};

const MODEL: &str = r#"
name = "predators that nobody counts"
parameters = ["a", "b", "c", "d"]
[states]
x1 = "a*x1 - b*x1*x2"
x2 = "-c*x2 + d*x1*x2"
[outputs]
y = "x1"
"#;

fn main() -> Result<(), ModelError> {
    let answer = analyze_system(&model_file::read(MODEL)?, SystemOptions::default())?;
    println!("rank {} of {}", answer.rank, answer.unknowns);
    for q in &answer.quantities {
        let degree = q.degree.map_or_else(|| "-".to_string(), |k| k.to_string());
        println!("  {:<3} degree {degree}  {} {}", q.name, q.status, q.partners.join(" "));
    }
    for c in &answer.invariants {
        println!("  {} is observable, degree {:?}", c.expression, c.degree);
    }
    for s in &answer.symmetries {
        println!("  no output changes when you {}", s.words);
    }
    Ok(())
}
