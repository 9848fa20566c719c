//! Figures and tables of the papers, made anew.

mod accuracy;
mod bwg03;
mod curves;
mod of99;

/// `cargo xtask figures of99`, `cargo xtask figures accuracy`, `cargo xtask figures economies [--data FOLDER]`, `cargo xtask figures bwg03 [--data FOLDER]`
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    match args {
        [name] if name == "of99" => of99::run(),
        [name] if name == "accuracy" => accuracy::run(),
        [name] if name == "economies" => accuracy::run_economies(None),
        [name, flag, folder] if name == "economies" && flag == "--data" => {
            accuracy::run_economies(Some(folder.as_ref()))
        }
        [name] if name == "bwg03" => bwg03::run(None),
        [name, flag, folder] if name == "bwg03" && flag == "--data" => bwg03::run(Some(folder.as_ref())),
        _ => Err(
            "usage: cargo xtask figures of99 | accuracy | economies [--data FOLDER] | bwg03 [--data FOLDER]"
                .to_owned(),
        ),
    }
}
