//! Lights asked for on the command line.

use std::str::FromStr;

use glam::DVec3;
use llsr_scene::PhotometricUnit;

/// An amount of light per time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flux {
    /// Amount, finite and not negative.
    pub value: f64,
    /// Its unit.
    pub unit: PhotometricUnit,
}

/// `MATERIAL=FLUX`: every long thin part of a material becomes a linear light of that flux.
///
/// ```
/// use llsr_io::TubeRequest;
///
/// let request: TubeRequest = "FluorescentTube=3000lm".parse()?;
/// assert_eq!(request.material, "FluorescentTube");
/// assert_eq!(request.flux.value, 3000.0);
/// # Ok::<(), llsr_io::ParseError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TubeRequest {
    /// Name of the material, as in the file.
    pub material: String,
    /// Flux of each tube.
    pub flux: Flux,
}

/// `x,y,z:x,y,z=FLUX`: a linear light between two points of the file's frame.
///
/// ```
/// use llsr_io::LineLightRequest;
///
/// let request: LineLightRequest = "-1,2.5,0:1,2.5,0=36W".parse()?;
/// assert_eq!(request.a.x, -1.0);
/// assert!("1,2:3,4,5=36W".parse::<LineLightRequest>().is_err());
/// # Ok::<(), llsr_io::ParseError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineLightRequest {
    /// First end, in the file's frame (m).
    pub a: DVec3,
    /// Second end (m).
    pub b: DVec3,
    /// Total flux.
    pub flux: Flux,
}

/// A command-line value that cannot be read; its text says what is wrong with which part and how it should look.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ParseError(String);

impl FromStr for Flux {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let text = text.trim();
        let (number, unit) = if let Some(number) = text.strip_suffix("lm") {
            (number, PhotometricUnit::Luminous)
        } else if let Some(number) = text.strip_suffix('W') {
            (number, PhotometricUnit::Radiant)
        } else {
            let cause =
                format!("flux {text:?} has no unit: write for example 3000lm (lumens) or 36W (watts)");
            return Err(ParseError(cause));
        };
        let value = parse_number(number, "flux")?;
        if value < 0.0 {
            return Err(ParseError(format!("flux {text:?} is negative")));
        }
        Ok(Self { value, unit })
    }
}

impl FromStr for TubeRequest {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        // The last sign: names of materials may hold one too.
        let Some((material, flux)) = text.rsplit_once('=') else {
            return Err(ParseError(format!("{text:?} has no flux: write MATERIAL=3000lm")));
        };
        if material.is_empty() {
            return Err(ParseError(format!(
                "{text:?} names no material: write MATERIAL=3000lm"
            )));
        }
        Ok(Self {
            material: material.to_owned(),
            flux: flux.parse()?,
        })
    }
}

impl FromStr for LineLightRequest {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        const FORM: &str = "write x,y,z:x,y,z=3000lm";
        let Some((ends, flux)) = text.rsplit_once('=') else {
            return Err(ParseError(format!("{text:?} has no flux: {FORM}")));
        };
        let Some((a, b)) = ends.split_once(':') else {
            return Err(ParseError(format!("{ends:?} is no pair of points: {FORM}")));
        };
        let (a, b) = (parse_point(a)?, parse_point(b)?);
        if a == b {
            return Err(ParseError(format!("both ends of {ends:?} are the same point")));
        }
        Ok(Self {
            a,
            b,
            flux: flux.parse()?,
        })
    }
}

/// Reads `x,y,z`; numbers may start with a minus.
///
/// # Errors
/// If there are not exactly three finite numbers.
///
/// ```
/// assert_eq!(llsr_io::parse_point("-1,2.5,1e1")?, glam::DVec3::new(-1.0, 2.5, 10.0));
/// # Ok::<(), llsr_io::ParseError>(())
/// ```
pub fn parse_point(text: &str) -> Result<DVec3, ParseError> {
    let numbers: Vec<&str> = text.split(',').collect();
    let [x, y, z] = numbers[..] else {
        let count = numbers.len();
        return Err(ParseError(format!(
            "{text:?} is no point: three numbers x,y,z are needed, not {count}"
        )));
    };
    let number = |text| parse_number(text, "coordinate");
    Ok(DVec3::new(number(x)?, number(y)?, number(z)?))
}

fn parse_number(text: &str, what: &str) -> Result<f64, ParseError> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(ParseError(format!("{what} {text:?} is not finite"))),
        Err(_) => Err(ParseError(format!("{what} {text:?} is not a number"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tubes_split_at_the_last_sign() {
        let request: TubeRequest = "a=b c = 12.5W".parse().expect("a name with a sign and blanks");
        assert_eq!(request.material, "a=b c ", "names are taken as they stand");
        assert_eq!(
            request.flux,
            Flux {
                value: 12.5,
                unit: PhotometricUnit::Radiant
            },
            "watts"
        );
    }

    #[test]
    fn lines_take_negative_and_scientific_numbers() {
        let request: LineLightRequest = "-1,-2e-1,3:0,0,-0.5=0lm".parse().expect("all signs");
        assert_eq!(request.a, DVec3::new(-1.0, -0.2, 3.0), "first end");
        assert_eq!(request.b, DVec3::new(0.0, 0.0, -0.5), "second end");
    }

    #[test]
    fn each_mistake_is_named() {
        let cause = |text: &str| {
            text.parse::<LineLightRequest>()
                .expect_err("wrong on purpose")
                .to_string()
        };
        for (text, part) in [
            ("1,2,3:4,5,6", "no flux"),
            ("1,2,3=5lm", "no pair of points"),
            ("1,2:4,5,6=5lm", "three numbers"),
            ("1,2,x:4,5,6=5lm", "\"x\" is not a number"),
            ("1,2,inf:4,5,6=5lm", "not finite"),
            ("1,2,3:4,5,6=5", "no unit"),
            ("1,2,3:4,5,6=-5lm", "negative"),
            ("1,2,3:4,5,6=nanW", "not finite"),
            ("1,2,3:4,5,6=lm", "not a number"),
            ("1,2,3:1,2,3=5lm", "same point"),
        ] {
            assert!(cause(text).contains(part), "{text}: {}", cause(text));
        }
        let no_name = "=5lm".parse::<TubeRequest>().expect_err("no name").to_string();
        assert!(no_name.contains("names no material"), "{no_name}");
    }
}
