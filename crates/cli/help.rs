//! `-h` prints a line for every option, inputs first; `--help` prints the full texts of options, with ranges
//! and words.

use clap::builder::StyledStr;
use clap::{Arg, ArgAction, Command};

/// Heading of an option's help section; `None` is clap's default section.
type Section = Option<&'static str>;

const ASSUMED: Section = Some("Assumptions");
const MEASURED: Section = Some("Measurement");
const ACCELEROMETERS: Section = Some("Accelerometer noise");
const RUN: Section = Some("Conditions of the run");
const GYROS: Section = Some("Gyro noise");
const WANTED: Section = Some("What is wanted");
const SEARCH: Section = Some("Search");
const PARTS: Section = Some("Parts");
const FURTHER: Section = Some("Further positions");
const MODELS: Section = Some("Models");
const SOLUTIONS: Section = Some("Solutions");
const CONTROLS: Section = Some("Controls");
const SHEET: Section = Some("Sheet");
const OUTPUT: Section = Some("Output");

/// One-line help texts: option by its name in the program, section, line. An entry for one command, as
/// `calibrate.step`, has precedence.
const LINES: &[(&str, Section, &str)] = &[
    ("calibrate.files", None, "Scheme or model file, then records of its runs; - is stdin"),
    ("allan.record", None, "Record of sensors at rest (CSV or Parquet); - is stdin"),
    ("column", None, "Column to use, by its name; may be given several times"),
    ("compare.files", None, "Scheme files (TOML); - is stdin"),
    ("simulate.files", None, "Scheme file (TOML) or model file (TOML, JSON); - is stdin"),
    ("procedure.files", None, "Scheme file (TOML); - is stdin"),
    ("crosscheck.files", None, "Scheme file (TOML) or model file (TOML, JSON); - is stdin"),
    ("files", None, "Scheme files (TOML) and model files (TOML, JSON); - is stdin"),
    ("angles", None, "Angles of a position in degrees, or letters (NUE); once per position"),
    ("combination", None, "Linear combination of unknowns to be judged too: \"D_IX - D_IY\""),
    ("calibrate.scheme", None, "Scheme file; FILEs are records then"),
    ("calibrate.model", None, "Model file; FILE is its record then"),
    ("before", None, "Calibration before of the same platform or system: the JSON of -o"),
    ("verify.certificate", None, "Certificate (JSON); - is stdin"),
    ("verify.scheme", None, "Scheme file (TOML) that the certificate must be of; - is stdin"),
    ("scheme", None, "File that must be a scheme"),
    ("model", None, "File that must be a model"),
    ("calibration", None, "Folder of `obsdeg calibrate -o`, or its calibration.json"),
    ("positions", None, "Find the best scheme of K positions"),
    ("minimum", None, "Find the fewest positions that make every coefficient observable"),
    (
        "conditions",
        None,
        "Scheme file whose conditions hold; model file whose outputs are chosen (--measure)",
    ),
    ("candidates", None, "Attitudes: cardinal, free, grid:45 or a scheme file"),
    ("carry", ASSUMED, "What goes on between positions: platform, inertial or reset"),
    ("analyze.latitude", ASSUMED, "Latitude in degrees; left out: generic"),
    ("report.latitude", ASSUMED, "Latitude in degrees (default: that of the file; 28.2 for numbers)"),
    ("latitude", ASSUMED, "Latitude in degrees (default: that of the file, or 28.2)"),
    ("terms", ASSUMED, "Unknown terms, as F,I,O,S; families: gyros, accelerometers, all"),
    ("axes", ASSUMED, "What defines the platform axes: accelerometers, gyros or body"),
    ("path", ASSUMED, "How the platform turns between positions: one-axis or gimbals"),
    ("measured_azimuth", ASSUMED, "The azimuth psi_y^n is measured too"),
    ("design.slew_rate", ASSUMED, "Rate of turns between positions in deg/s (default: at once)"),
    ("gimbal", ASSUMED, "Range of a gimbal in degrees: alpha=-90:90"),
    ("calibrate.noise", ASSUMED, "White noise of Z per sample and axis, in g"),
    ("calibrate.azimuth_noise", ASSUMED, "Noise of a measured azimuth per sample, in deg"),
    ("calibrate.step", ASSUMED, "Samples within so many s are one measurement"),
    ("calibrate.slew_rate", ASSUMED, "Rate of turns between positions in deg/s"),
    ("calibrate.drift_noise", ASSUMED, "Random drift with its unit: \"0.01 deg/h\""),
    ("dry_run", OUTPUT, "Show how the records are read, and estimate nothing"),
    ("estimate_noise", ASSUMED, "Estimate the noise of every component of Z from the residuals"),
    ("gravity", ASSUMED, "One g in m/s^2"),
    ("confidence", ASSUMED, "Probability that a confidence band holds a deviation"),
    ("gate", ASSUMED, "Probability that no good sample is taken as outlier"),
    ("runs", ASSUMED, "Number of Monte Carlo runs"),
    ("monte_carlo", ASSUMED, "Number of Monte Carlo runs of the evidence"),
    ("paper.seed", None, "Seed of the random points and of the noise"),
    ("verify.seed", None, "Seed of the choice of blocks (default: a number of the system)"),
    ("seed", ASSUMED, "Seed of all random choices"),
    ("dwell", MEASURED, "Dwell of positions that do not say theirs, in s (default: 1000)"),
    ("step", MEASURED, "Largest time between samples, in s (default: 10)"),
    ("noise", MEASURED, "White noise of Z per sample and axis, in g (default: 1e-5)"),
    ("azimuth_noise", MEASURED, "Noise of a measured azimuth per sample, in deg (default: 0.001)"),
    ("requirement", MEASURED, "Largest sigma allowed of an unknown or family: D=0.05, K1=5"),
    ("bench", MEASURED, "Sizes (1 sigma) of errors that are not estimated: K0=20,latitude=10"),
    ("design.prior", MEASURED, "Sigma of an unknown or family that is known beforehand: psi=0.05"),
    ("accelerometer_instability", ACCELEROMETERS, "Bias instability in ug (default: none)"),
    ("accelerometer_correlation_time", ACCELEROMETERS, "Its correlation time, in s (default: 3600)"),
    ("truth", RUN, "Simulated truth: linear or exact (default: linear)"),
    ("filter", RUN, "Filter: linear, extended or iterated (default: by the model)"),
    ("slew_rate", RUN, "Rate of turns between positions in deg/s (default: at once)"),
    ("drift_noise", MEASURED, "Random drift with its unit: \"0.01 deg/h\", \"0.001 deg/sqrt(h)\""),
    ("propagation", RUN, "Transition matrix of the filter: exponential or rk4"),
    ("value", RUN, "True value of an unknown or family: D_FX=11, psi=0.1"),
    ("prior", MEASURED, "Initial standard deviation of an unknown or family: D_F=20"),
    ("estimate", RUN, "Initial estimate of an unknown or family (default: 0)"),
    ("drift_scale", RUN, "Factor on the true drifts and their priors (default: 1)"),
    ("angle_random_walk", GYROS, "Angle random walk in deg/sqrt(h), of all gyros or X,Y,Z"),
    ("rate_random_walk", GYROS, "Rate random walk in deg/h/sqrt(h), of all gyros or X,Y,Z"),
    ("bias_instability", GYROS, "Bias instability in deg/h, of all gyros or X,Y,Z"),
    ("correlation_time", GYROS, "Correlation time of the bias instability, in s (default: 3600)"),
    ("observable", WANTED, "Coefficients that must be observable: D_F,D_IX (default: all)"),
    ("max_degree", WANTED, "Largest degree, of all or of a coefficient or family: 1, D_F=1"),
    ("immune", WANTED, "Errors without effect, or seen from a size on: K0, K0=20"),
    ("criterion", WANTED, "Criterion: worst, a, d, e or margin (default: worst)"),
    ("meet", WANTED, "Only schemes that meet every requirement; where none does, what would"),
    ("max_time", WANTED, "Largest total time with turns, in s"),
    ("max_slew", WANTED, "Longest turn between successive positions, in s"),
    ("max_turn", WANTED, "Largest turn in degrees, with --minimum and torquer errors"),
    ("keep", SEARCH, "Number of schemes listed (default: 10)"),
    ("within", SEARCH, "Under reset carry: search all unless within PERCENT of a bound; 0: all"),
    ("restarts", SEARCH, "Restarts of the exchange (default: 200)"),
    ("round", SEARCH, "Step of the angles of --candidates free, in degrees (default: 5)"),
    ("refine", SEARCH, "Move the angles of the best scheme continuously"),
    ("divide", SEARCH, "Divide the total time among the positions of the best scheme"),
    ("front", SEARCH, "Other numbers of positions for the front of time against criterion"),
    ("part", PARTS, "Search part I of N of all sequences, and write it to the file of -o"),
    ("merge", PARTS, "Put parts together to the answer of the whole; they know their options"),
    ("check", PARTS, "With --merge: search N blocks of the parts again, chosen at random"),
    ("next", FURTHER, "Find the 1 or 2 positions by which the scheme gains most"),
    ("after", FURTHER, "With --next: calibration.json that is known beforehand"),
    ("days", FURTHER, "With --after: days of ageing since then, such as 30,90,365"),
    ("measure", MODELS, "Candidates for outputs of a model: states, or \"x1, x1 + x3\""),
    ("own_outputs", MODELS, "The outputs of the model stay, and candidates are added"),
    ("unique", MODELS, "Every required unknown must have one solution"),
    ("cost", MODELS, "Cost of a candidate: x1=2.5 (default: 1)"),
    ("order", MODELS, "Highest order of derivatives where a model has no proven end"),
    ("count_limit", MODELS, "Work of counting the solutions of a model (default: 3)"),
    ("work_limit", MODELS, "Work of a verdict: millions of operations (default: 600)"),
    ("relation_limit", MODELS, "Work of global verdicts by output relations (default: 50)"),
    ("starts", MODELS, "Starts of the iteration"),
    ("profile", MODELS, "Unknown whose profile is drawn; once per unknown"),
    ("solutions", SOLUTIONS, "Expressions and numbers of solutions: on or off"),
    ("omitted", SOLUTIONS, "Classes of errors that are not estimated: on or off"),
    ("sensitivities", SOLUTIONS, "Changes of the estimates per unit of such errors"),
    ("why", SOLUTIONS, "Explain the verdict on an unknown, and what would improve it"),
    ("frame", SOLUTIONS, "Axes of Z in solutions: n or platform"),
    ("formulas", SOLUTIONS, "Print Z, its derivatives, psi and eps as formulas"),
    ("symbolic_limit", SOLUTIONS, "Work of the symbolic engine for one formula; 0: none"),
    ("engine_wait", SOLUTIONS, "Longest wait for the symbolic engine, in s"),
    ("filter_carry", CONTROLS, "Make the filter wrong: another carry"),
    ("filter_latitude", CONTROLS, "Make the filter wrong: another latitude in degrees"),
    ("filter_drop", CONTROLS, "Make the filter wrong: it does not know of this position"),
    ("settle", SHEET, "Time at rest before each recording, in s"),
    ("tilt", SHEET, "Tilt that a reading may always show, in degrees (default: 1)"),
    ("dialect", SHEET, "Table for a controller: generic or psins"),
    ("start", SHEET, "Attitude at the start of a rotation table"),
    ("rotations", SHEET, "Rotation table instead of a scheme: k, Ux, Uy, Uz, angle, T, T0, T1"),
    ("details", OUTPUT, "Print the details of the table too"),
    ("pdf_by", OUTPUT, "Maker of a PDF: browser, the path of one, or typesetter"),
    ("report.format", OUTPUT, "Format: html, pdf, markdown or latex (default: by the file's ending)"),
    ("format", OUTPUT, "Format: table, json, markdown, csv or latex"),
    ("table", OUTPUT, "List of the JSON that the CSV holds (default: the main one)"),
    ("ascii", OUTPUT, "Nothing but ASCII in tables and messages"),
    ("design.output", OUTPUT, "Folder for summary, scheme and figures; with --part a file"),
    ("simulate.output", OUTPUT, "Folder for summary, series and figures; or a .json, .md, .csv, .tex file"),
    ("crosscheck.output", OUTPUT, "Folder for evidence and figures; or a .json, .md, .csv, .tex file"),
    ("procedure.output", OUTPUT, "Folder for the sheet, its page, tables and the record's header"),
    ("allan.output", OUTPUT, "Folder for coefficients, deviations, settings and figures"),
    ("calibrate.output", OUTPUT, "Folder for calibration, coefficients, residuals and figures"),
    ("man.output", None, "Folder for all pages: obsdeg.1, obsdeg-analyze.1 and so on"),
    ("output", OUTPUT, "File to write to instead of stdout (-)"),
    ("figures", OUTPUT, "Folder for a picture of the positions of every scheme"),
    ("design.certificate", OUTPUT, "File for a proof of the best sequence, which obsdeg verify checks"),
    ("certificate", OUTPUT, "File for a proof of the verdicts, which obsdeg verify checks"),
    ("reduced", OUTPUT, "File for a model with the same outputs that is fully observable"),
    ("blocks", None, "Blocks of the certificate of an optimum that are searched again"),
    ("man.force", None, "Replace files in the folder"),
    ("force", OUTPUT, "Replace files that are there"),
    ("quiet", OUTPUT, "Say nothing on stderr but errors and what is missing in the answer"),
    ("shell", None, "Shell: bash, elvish, fish, powershell or zsh"),
    ("command", None, "Command whose page it is (default: that of the program)"),
    ("kind", None, "Answer or file that the schema describes, such as analysis, design or scheme"),
];

/// `command` with a line for every option, and with its examples and notes in `--help` only. `short`: true
/// for `-h`, whose lines name the words of an option themselves.
pub(crate) fn in_lines(command: Command, short: bool) -> Command {
    let name = command.get_name().to_string();
    let notes = command.get_after_help().cloned();
    let has_output = command.get_arguments().any(|arg| arg.get_id() == "quiet");
    let command = command.mut_args(|arg| in_a_line(arg, &name, short)).disable_help_flag(true).arg(
        Arg::new("help")
            .short('h')
            .long("help")
            .action(ArgAction::Help)
            .help("Print help: -h in lines, --help at length")
            .help_heading(OUTPUT.filter(|_| has_output)),
    );
    match notes {
        Some(notes) => command
            .after_long_help(notes)
            .after_help(format!("Examples, ranges, units and exit codes: obsdeg {name} --help")),
        None => command,
    }
}

/// One-line help of an option of a command, `None` if the table has none.
fn line(command: &str, id: &str) -> Option<&'static (&'static str, Section, &'static str)> {
    let own = format!("{command}.{id}");
    LINES.iter().find(|(of, ..)| *of == own).or_else(|| LINES.iter().find(|(of, ..)| *of == id))
}

fn in_a_line(arg: Arg, command: &str, short: bool) -> Arg {
    let Some((_, section, text)) = line(command, arg.get_id().as_str()) else { return arg };
    let long: StyledStr = arg.get_long_help().or(arg.get_help()).cloned().unwrap_or_default();
    // --seed, which every command has, comes last in its section
    let arg = if arg.get_id() == "seed" { arg.display_order(900) } else { arg };
    let has_words = arg.get_action().takes_values();
    arg.help(*text).long_help(long).help_heading(*section).hide_possible_values(short && has_words)
}
