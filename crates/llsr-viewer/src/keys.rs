//! What the keys do: one table for the program and its help.

/// Something that a key asks for once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Show or hide the list of keys.
    Help,
    /// Show or hide the numbers.
    Numbers,
    /// Show or hide edges: pixels with one edge violet, complex ones green.
    Edges,
    /// Show the pixels that have a sample, or the picture.
    Samples,
    /// Show how much of its surroundings each pixel reaches, or the picture.
    Reach,
    /// Interpolate across edges, for comparison, or not.
    Blind,
    /// Trace every pixel, without edges and kept points, or not.
    RayTrace,
    /// Show or hide lights as lines.
    Lights,
    /// The next shader.
    Shader,
    /// Twice as many new samples a frame, or half of them.
    Samples2(bool),
    /// Brighter or darker by half a stop.
    Exposure(bool),
    /// Exposure that suits the picture.
    ExposureAuto,
    /// Turn on the spot, or go round what is under the pointer.
    Steering,
    /// Back to the first camera.
    Home,
    /// Everything that was dragged back to its place.
    Restore,
    /// Forget all samples.
    Forget,
    /// Begin or end recording the camera's path.
    Record,
    /// Save a finished picture, or give up the one that is being made.
    Save,
    /// End.
    Quit,
}

/// Directions in which one flies as long as a key is down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flight {
    /// Along the view.
    Ahead,
    /// Against it.
    Back,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Up.
    Up,
    /// Down.
    Down,
    /// Four times as fast.
    Fast,
}

/// What a key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Once, when pressed.
    Do(Action),
    /// While held.
    Fly(Flight),
}

/// A key, by its place on a US keyboard (the names of `KeyboardEvent.code` of the W3C's UI Events).
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Names of keys that mean the same.
    pub codes: &'static [&'static str],
    /// What they do.
    pub meaning: Meaning,
    /// The keys as people call them.
    pub shown: &'static str,
    /// What happens, in a few words.
    pub help: &'static str,
}

const fn key(
    codes: &'static [&'static str],
    meaning: Meaning,
    shown: &'static str,
    help: &'static str,
) -> Binding {
    Binding {
        codes,
        meaning,
        shown,
        help,
    }
}

/// All keys. Several of one line share the help of the first.
pub const BINDINGS: &[Binding] = &[
    key(
        &["KeyW", "ArrowUp"],
        Meaning::Fly(Flight::Ahead),
        "W A S D arrows",
        "fly",
    ),
    key(&["KeyS", "ArrowDown"], Meaning::Fly(Flight::Back), "", ""),
    key(&["KeyA", "ArrowLeft"], Meaning::Fly(Flight::Left), "", ""),
    key(&["KeyD", "ArrowRight"], Meaning::Fly(Flight::Right), "", ""),
    key(&["KeyE", "PageUp"], Meaning::Fly(Flight::Up), "E Q", "up, down"),
    key(&["KeyQ", "PageDown"], Meaning::Fly(Flight::Down), "", ""),
    key(
        &["ShiftLeft", "ShiftRight"],
        Meaning::Fly(Flight::Fast),
        "Shift",
        "four times as fast",
    ),
    key(
        &["KeyO"],
        Meaning::Do(Action::Steering),
        "O",
        "left drag goes round things / turns",
    ),
    key(
        &["Home"],
        Meaning::Do(Action::Home),
        "Home",
        "back to the first camera",
    ),
    key(&["KeyG"], Meaning::Do(Action::Edges), "G", "edges"),
    key(
        &["KeyP"],
        Meaning::Do(Action::Samples),
        "P",
        "pixels with a sample",
    ),
    key(&["KeyR"], Meaning::Do(Action::Reach), "R", "how far pixels reach"),
    key(
        &["KeyB"],
        Meaning::Do(Action::Blind),
        "B",
        "blind interpolation, for comparison",
    ),
    key(&["KeyT"], Meaning::Do(Action::RayTrace), "T", "plain ray tracing"),
    key(&["KeyL"], Meaning::Do(Action::Lights), "L", "lights as lines"),
    key(&["KeyN"], Meaning::Do(Action::Shader), "N", "next shader"),
    key(
        &["BracketLeft"],
        Meaning::Do(Action::Samples2(false)),
        "[ ]",
        "fewer, more samples a frame",
    ),
    key(&["BracketRight"], Meaning::Do(Action::Samples2(true)), "", ""),
    key(
        &["Minus", "NumpadSubtract"],
        Meaning::Do(Action::Exposure(false)),
        "- = 0",
        "darker, brighter, automatic",
    ),
    key(
        &["Equal", "NumpadAdd"],
        Meaning::Do(Action::Exposure(true)),
        "",
        "",
    ),
    key(&["Digit0", "Numpad0"], Meaning::Do(Action::ExposureAuto), "", ""),
    key(
        &["Backspace"],
        Meaning::Do(Action::Restore),
        "Backspace",
        "dragged things back",
    ),
    key(&["KeyF"], Meaning::Do(Action::Forget), "F", "forget all samples"),
    key(
        &["KeyC"],
        Meaning::Do(Action::Record),
        "C",
        "record the camera's path / stop",
    ),
    key(
        &["KeyX", "F12"],
        Meaning::Do(Action::Save),
        "X",
        "save a finished picture / give up",
    ),
    key(&["KeyI"], Meaning::Do(Action::Numbers), "I", "numbers"),
    key(&["KeyH", "F1"], Meaning::Do(Action::Help), "H F1", "this list"),
    key(&["Escape"], Meaning::Do(Action::Quit), "Escape", "quit"),
];

/// What the mouse does: button or wheel, and what happens.
pub const MOUSE: &[(&str, &str)] = &[
    ("left drag", "turn, or go round"),
    ("right drag", "move an object or a light"),
    ("middle drag", "move in the picture's plane"),
    ("wheel", "nearer; Shift: wider; flying: faster"),
];

/// What the key of that code does.
pub fn meaning(code: &str) -> Option<Meaning> {
    let binding = BINDINGS.iter().find(|binding| binding.codes.contains(&code));
    binding.map(|binding| binding.meaning)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_means_two_things() {
        let codes: Vec<&str> = BINDINGS
            .iter()
            .flat_map(|binding| binding.codes)
            .copied()
            .collect();
        for (i, code) in codes.iter().enumerate() {
            assert!(!codes[i + 1..].contains(code), "{code}");
        }
    }

    #[test]
    fn every_meaning_has_a_key_and_only_one_entry() {
        for (i, binding) in BINDINGS.iter().enumerate() {
            let again = BINDINGS[i + 1..]
                .iter()
                .any(|other| other.meaning == binding.meaning);
            assert!(!again && !binding.codes.is_empty(), "{:?}", binding.meaning);
        }
        assert_eq!(
            meaning("F1"),
            Some(Meaning::Do(Action::Help)),
            "looked up by code"
        );
        assert_eq!(meaning("F7"), None, "not in use");
    }
}
