//! All external tests in one binary: compiled once, linked once, and run in parallel. The tests of the
//! symbolic worker are a separate binary, because they hold the lock of the engine.

mod algebraic;
mod allan;
#[cfg(unix)]
mod book;
mod branches;
mod browser;
mod calibrate;
mod chain;
mod cli;
mod commands;
mod compare;
mod conventions;
mod crosscheck;
mod design;
mod discrete;
mod engines;
mod examples;
mod expressions;

#[cfg(unix)]
mod figures;
mod files;
mod formulas;
mod front_door;
mod functions;
mod grammar;
mod help;
mod hostile;
mod identifiability;
mod language;
mod laws;
mod licences;
mod models;
mod not_estimated;
mod points;
mod procedure;
mod program;
mod recorded;
mod reference_verdicts;
mod release;
mod remedies;
mod report;
mod report_page;
mod rotation;
mod run_sentences;
mod schemas;
mod scheme_schema;
mod schemes;
mod second_path;
mod sensors;
mod sentences;
mod simulation;
mod small_models;
mod solutions;
mod structure;
mod validator;
mod whole_platform;
mod why;
