//! Figures and tables of the papers, made anew.

mod accuracy;
mod bwg03;
mod curves;
mod of99;

const USAGE: &str =
    "usage: cargo xtask figures of99 | accuracy | economies [--data FOLDER] | bwg03 [--data FOLDER] [NAME]";

/// `cargo xtask figures`; see [`USAGE`].
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    match args {
        [name] if name == "of99" => of99::run(),
        [name] if name == "accuracy" => accuracy::run(),
        [name] if name == "economies" => accuracy::run_economies(None),
        [name, flag, folder] if name == "economies" && flag == "--data" => {
            accuracy::run_economies(Some(folder.as_ref()))
        }
        [name, rest @ ..] if name == "bwg03" => match rest {
            [] => bwg03::run(None, None),
            [flag, folder] if flag == "--data" => bwg03::run(Some(folder.as_ref()), None),
            [only] => bwg03::run(None, Some(only)),
            [flag, folder, only] if flag == "--data" => bwg03::run(Some(folder.as_ref()), Some(only)),
            _ => Err(USAGE.to_owned()),
        },
        _ => Err(USAGE.to_owned()),
    }
}
