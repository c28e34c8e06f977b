//! The real binary, run as a user runs it: each test in a folder of its own.

mod check;
mod faults;
mod folder;
mod info;
mod interrupts;
mod models;
mod outputs;
mod usage;
