//! Figures and tables of the papers, made anew.

mod accuracy;
mod bwg03;
mod curves;
mod of99;

/// `cargo xtask figures of99`, `cargo xtask figures accuracy [--data FOLDER]`, `cargo xtask figures bwg03 [--data FOLDER]`
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    match args {
        [name] if name == "of99" => of99::run(),
        [name] if name == "accuracy" => accuracy::run(None),
        [name, flag, folder] if name == "accuracy" && flag == "--data" => {
            accuracy::run(Some(folder.as_ref()))
        }
        [name] if name == "bwg03" => bwg03::run(None),
        [name, flag, folder] if name == "bwg03" && flag == "--data" => bwg03::run(Some(folder.as_ref())),
        _ => Err(
            "usage: cargo xtask figures of99 | accuracy [--data FOLDER] | bwg03 [--data FOLDER]".to_owned(),
        ),
    }
}
