//! Figures and tables of the papers, made anew.

mod curves;
mod of99;

/// `cargo xtask figures of99`
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    match args {
        [name] if name == "of99" => of99::run(),
        _ => Err("usage: cargo xtask figures of99".to_owned()),
    }
}
