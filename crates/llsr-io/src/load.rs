//! Loading a scene: which reader, the lights asked for, the last checks.

use std::path::Path;

use llsr_scene::{EmissionLaw, LinearLight, PhotometricUnit, Scene};

use crate::error::Error;
use crate::import::{Import, MOST_LIGHTS};
use crate::request::{LineLightRequest, TubeRequest};
use crate::warning::{Warning, Warnings};
use crate::{files, gltf, obj, tubes};

/// What is asked for besides what stands in the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Materials whose long thin parts become linear lights.
    pub tubes: Vec<TubeRequest>,
    /// Further linear lights.
    pub line_lights: Vec<LineLightRequest>,
    /// Emission law of the lights asked for here; those of the file have their own.
    pub emission: EmissionLaw,
    /// Whether the file's own lights and emissive materials are luminous or radiant, if it does not say so;
    /// `None` means luminous, as glTF has it.
    pub unit: Option<PhotometricUnit>,
}

/// A scene and what was not taken as it stood.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene, recentred: file = scene + [`Scene::origin`].
    pub scene: Scene,
    /// What was repaired, replaced, left out or ignored; one for each kind.
    pub warnings: Vec<Warning>,
}

/// Reads a scene from a `.obj`, `.gltf` or `.glb` file and the files that it names beside it.
///
/// Lights come from the file (`KHR_lights_punctual` with `extras.llsr.length`, emissive tubes) and from `options`; see
/// the crate's documentation. Everything is moved in double precision so that the middle of the geometry is the
/// origin, hence coordinates a million metres off keep their detail. A scene without lights is not an error here:
/// not every use needs one.
///
/// Files are not trusted: what can be left out or repaired is, with a warning; the rest is an error. Memory stays in
/// proportion to the size of the files, plus at most 1 GiB.
///
/// # Errors
/// If the file cannot be read or is beyond repair, names an extension that it requires and that is unknown here, holds nothing
/// usable, lacks a material asked for, or mixes lumens and watts.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<Loaded, Error> {
    // Before reading what nothing can be done with.
    Format::of(path)?;
    read_scene(path, files::read(path, files::LARGEST_FILE)?, options)
}

/// Reads a scene from the bytes of a file, as [`load_scene`] does; `path` says which format it is, where the files
/// beside it are, and what to call it in messages. It need not exist.
///
/// # Errors
/// As [`load_scene`].
pub fn read_scene(path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<Loaded, Error> {
    let mut warnings = Warnings::default();
    let mut import = match Format::of(path)? {
        Format::Obj => obj::read(path, &bytes, &mut warnings)?,
        Format::Gltf => gltf::read(path, bytes, &mut warnings)?,
    };
    if import.name.is_empty() {
        import.name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
    }
    let mut own_lights = !import.lights.is_empty();
    own_lights |= tubes::extract(path, &mut import, options, &mut warnings)?;
    import.unit = Some(settle_unit(&import, options, own_lights)?);
    for request in &options.line_lights {
        let mut light = LinearLight::new("line", request.a, request.b, request.flux.value);
        light.emission = options.emission;
        import.add_linear(light, &mut warnings);
    }
    if import.lights.len() > MOST_LIGHTS {
        let cause = format!(
            "there are {}, at most {MOST_LIGHTS} are read",
            import.lights.len()
        );
        return Err(Error::malformed(path, "lights", cause));
    }

    let scene = import.into_scene(&mut warnings);
    let warnings = warnings.into_list();
    if scene.objects.is_empty() && scene.lights.is_empty() {
        let notes = warnings.iter().map(ToString::to_string).collect();
        return Err(Error::Empty {
            path: path.to_owned(),
            notes,
        });
    }
    Ok(Loaded { scene, warnings })
}

/// What an ending stands for.
enum Format {
    Obj,
    Gltf,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Error> {
        let ending = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_ascii_lowercase();
        match ending.as_str() {
            "obj" => Ok(Self::Obj),
            "gltf" | "glb" => Ok(Self::Gltf),
            _ => {
                let (what, use_instead) = ("scenes", ".obj, .gltf or .glb");
                Err(Error::Ending {
                    path: path.to_owned(),
                    what,
                    ending,
                    use_instead,
                })
            }
        }
    }
}

/// The one unit of all fluxes.
fn settle_unit(import: &Import, options: &LoadOptions, own_lights: bool) -> Result<PhotometricUnit, Error> {
    let own = import.unit.or(options.unit).unwrap_or_default();
    let mut settled =
        (import.unit.is_some() || own_lights).then(|| ("the light of the file".to_owned(), own));
    let tubes = options
        .tubes
        .iter()
        .map(|t| (format!("--tube {}", t.material), t.flux.unit));
    let lines = options.line_lights.iter().map(|l| {
        let (a, b) = (l.a, l.b);
        (
            format!("--line-light {},{},{}:{},{},{}", a.x, a.y, a.z, b.x, b.y, b.z),
            l.flux.unit,
        )
    });
    for (what, unit) in tubes.chain(lines) {
        match &settled {
            None => settled = Some((what, unit)),
            Some((first_what, first)) if *first != unit => {
                return Err(Error::MixedUnits {
                    first_what: first_what.clone(),
                    first: *first,
                    second_what: what,
                    second: unit,
                });
            }
            Some(_) => {}
        }
    }
    Ok(settled.map_or(own, |(_, unit)| unit))
}
