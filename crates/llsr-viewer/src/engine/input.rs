//! Keys and mouse.

use std::sync::Arc;
use std::time::Instant;

use llsr_io::Development;

use super::{Engine, Gesture};
use crate::canvas::ToneTable;
use crate::grip::{Grip, surface_under};
use crate::jobs::{Trace, free_name, save_picture};
use crate::keys::{Action, Flight, Meaning, meaning};
use crate::overlay;
use crate::record::Recorder;
use crate::rig::Steering;

/// Radians that the camera turns for a pixel of the mouse.
const TURN: f64 = 0.005;
/// Factor of the distance for one notch of the wheel.
const NOTCH: f64 = 0.88;
/// Samples a frame: least and most.
const SAMPLES: (usize, usize) = (16, 1 << 18);

/// A button of the mouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// Turns.
    Left,
    /// Moves the camera in the picture's plane.
    Middle,
    /// Drags.
    Right,
}

impl Engine {
    /// A key, by its code (see [`Binding`](crate::Binding)), goes down or up. Repetitions are to be left out.
    pub fn key(&mut self, code: &str, down: bool) {
        match meaning(code) {
            Some(Meaning::Do(action)) if down => self.act(action),
            Some(Meaning::Fly(flight)) => {
                self.flight.retain(|&other| other != flight);
                if down {
                    self.flight.push(flight);
                }
            }
            _ => {}
        }
    }

    /// The window no longer hears the keyboard: whatever was down is up.
    pub fn release_all(&mut self) {
        self.flight.clear();
        self.gesture = None;
    }

    /// The pointer is at (`x`, `y`), in pixels of the picture.
    pub fn pointer(&mut self, x: f64, y: f64) {
        let (dx, dy) = (x - self.pointer.0, y - self.pointer.1);
        self.pointer = (x, y);
        let height = f64::from(self.viewport.height);
        match &mut self.gesture {
            None => {}
            // What is seen follows the pointer.
            Some(Gesture::Turn) => self.rig.turn(dx * TURN, dy * TURN),
            Some(Gesture::Orbit(pivot)) => self.rig.orbit(*pivot, -dx * TURN, -dy * TURN),
            Some(Gesture::Pan(distance)) => self.rig.pan(dx, dy, height, *distance),
            Some(Gesture::Drag(_, moved)) => *moved = true,
        }
    }

    /// A button goes down or up, where the pointer is.
    pub fn button(&mut self, button: Button, down: bool) {
        if !down {
            self.gesture = None;
            return;
        }
        let (x, y) = self.pointer;
        let camera = self.rig.camera();
        let under = || surface_under(&self.world, camera, self.viewport, x, y).map(|(_, point)| point);
        let depth = |point: glam::DVec3| (point - camera.position).dot(camera.forward());
        let far = || f64::from(self.world.bounds().diagonal());
        let gesture = match button {
            Button::Left if self.steering == Steering::Orbit => under().map_or(Gesture::Turn, Gesture::Orbit),
            Button::Left => Gesture::Turn,
            Button::Middle => Gesture::Pan(under().map_or_else(far, depth)),
            Button::Right => {
                let lights = self.shown.lights;
                let Some(grip) = Grip::take(&self.world, camera, self.viewport, (x, y), lights) else {
                    self.say("nothing to drag here".to_owned());
                    return;
                };
                if !grip.can_move(&self.world) {
                    let name = grip.name(&self.world).to_owned();
                    self.say(format!("'{name}' encloses the rest and stays"));
                    return;
                }
                let kind = if grip.is_light() { "light" } else { "object" };
                let name = grip.name(&self.world).to_owned();
                self.say(format!("dragging {kind} '{name}'"));
                Gesture::Drag(Box::new(grip), false)
            }
        };
        self.gesture = Some(gesture);
    }

    /// The wheel turns by so many notches, away from the user if positive.
    pub fn wheel(&mut self, notches: f64) {
        let factor = NOTCH.powf(notches.clamp(-20.0, 20.0));
        if self.flight.contains(&Flight::Fast) {
            self.rig.widen(factor);
        } else if self.flight.iter().any(|&flight| flight != Flight::Fast) {
            self.rig.change_speed(factor.recip());
        } else {
            let (x, y) = self.pointer;
            let (origin, direction) = self.rig.camera().ray(self.viewport, x, y);
            let nothing = || origin + direction * f64::from(self.world.bounds().diagonal());
            let under = surface_under(&self.world, self.rig.camera(), self.viewport, x, y);
            let pivot = under.map_or_else(nothing, |(_, point)| point);
            self.rig.approach(pivot, factor);
        }
    }

    /// Flies for so long, where the keys say.
    pub(super) fn fly(&mut self, seconds: f64) {
        let amount = |plus: Flight, minus: Flight| {
            f64::from(u8::from(self.flight.contains(&plus)))
                - f64::from(u8::from(self.flight.contains(&minus)))
        };
        let (right, up, ahead) = (
            amount(Flight::Right, Flight::Left),
            amount(Flight::Up, Flight::Down),
            amount(Flight::Ahead, Flight::Back),
        );
        if (right, up, ahead) != (0.0, 0.0, 0.0) {
            let fast = if self.flight.contains(&Flight::Fast) {
                4.0
            } else {
                1.0
            };
            let way = seconds * fast * self.rig.speed();
            self.rig.step(right * way, up * way, ahead * way);
        }
    }

    fn act(&mut self, action: Action) {
        let shown = &mut self.shown;
        match action {
            Action::Help => shown.help ^= true,
            Action::Numbers => shown.numbers ^= true,
            Action::Edges => shown.edges ^= true,
            Action::Samples => {
                shown.samples ^= true;
                shown.reach = false;
            }
            Action::Reach => {
                shown.reach ^= true;
                shown.samples = false;
            }
            Action::Blind => shown.blind ^= true,
            Action::RayTrace => shown.ray_trace ^= true,
            Action::Lights => shown.lights ^= true,
            Action::Shader if self.shaders.len() > 1 => {
                self.change_shader((self.chosen + 1) % self.shaders.len());
            }
            Action::Shader => self.say("there is only this shader".to_owned()),
            Action::Samples2(more) => {
                let samples = if more { self.samples * 2 } else { self.samples / 2 };
                self.samples = samples.clamp(SAMPLES.0, SAMPLES.1);
            }
            Action::Exposure(brighter) => self.expose(self.exposure + if brighter { 0.5 } else { -0.5 }),
            Action::ExposureAuto => self.expose_automatically(),
            Action::Steering => {
                self.steering = match self.steering {
                    Steering::Fly => Steering::Orbit,
                    Steering::Orbit => Steering::Fly,
                };
                self.say(match self.steering {
                    Steering::Fly => "left drag: turn on the spot".to_owned(),
                    Steering::Orbit => "left drag: go round what is under the pointer".to_owned(),
                });
            }
            Action::Home => self.rig.jump(self.home.0.clone()),
            Action::Restore => self.restore(),
            Action::Forget => self.renderer.forget(),
            Action::Record => self.record(),
            Action::Save => self.save(),
            Action::Quit => self.quit = true,
        }
    }

    fn expose(&mut self, exposure: f64) {
        self.exposure = exposure;
        self.table = ToneTable::new(self.settings.tone, exposure);
    }

    pub(super) fn expose_automatically(&mut self) {
        let picture = self.renderer.picture();
        let (width, height) = picture.size();
        let pixels: Vec<_> = (0..height)
            .flat_map(|y| (0..width).map(move |x| picture.pixel(x, y)))
            .collect();
        self.expose(llsr_io::exposure_for(&pixels));
    }

    fn record(&mut self) {
        let Some(recorder) = self.recorder.take() else {
            self.recorder = Some(Recorder::default());
            return;
        };
        let path = free_name(&self.settings.path_stem, "txt");
        let recorded = recorder.finish();
        let text = recorded.to_text(self.viewport, self.world.scene().origin);
        match llsr_io::write_file(&path, text.as_bytes()) {
            Ok(()) => {
                let steps = recorded.cameras.len();
                self.say(format!("{steps} steps: llsr walk --path {}", path.display()));
                self.report.files.push(path);
            }
            Err(error) => self.complain(error.to_string()),
        }
    }

    fn save(&mut self) {
        if self.saving.take().is_some() {
            self.say("the picture was given up".to_owned());
            return;
        }
        let development = Development {
            exposure: self.exposure,
            tone: self.settings.tone,
        };
        // A shader of its own, so that things may be moved meanwhile.
        let shader = match (self.shaders[self.chosen].make)(Arc::clone(&self.world)) {
            Ok(shader) => shader,
            Err(error) => {
                self.complain(error);
                return;
            }
        };
        let trace = Trace {
            shader,
            camera: self.rig.camera().clone(),
            viewport: self.viewport,
            seed: self.settings.frames.seed,
        };
        match save_picture(trace, &self.settings.picture, development) {
            Ok(job) => self.saving = Some(job),
            Err(error) => self.complain(error.to_string()),
        }
    }

    pub(super) fn say(&mut self, text: String) {
        self.message = Some((overlay::MESSAGE, text, Instant::now()));
    }

    pub(super) fn complain(&mut self, text: String) {
        self.message = Some((overlay::ERROR, text, Instant::now()));
    }

    pub(super) fn say_help(&mut self) {
        self.say("H: keys   right drag: move things   Escape: quit".to_owned());
    }
}
