//! The window: winit's events to the engine, the engine's pixels to the screen.

use std::num::NonZeroU32;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

use llsr_scene::{Camera, Viewport};
use llsr_shading::World;
use softbuffer::{Context, Surface};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::PhysicalKey;
use winit::window::{Window, WindowId};

use crate::engine::{Button, Engine};
use crate::settings::{ShaderChoice, ViewError, ViewReport, ViewSettings};

/// Shortest time between the beginnings of two frames.
const FRAME: Duration = Duration::from_nanos(16_666_667);
/// The same when nobody has touched anything for a while.
const IDLE_FRAME: Duration = Duration::from_millis(66);
/// What a while is.
const IDLE_AFTER: Duration = Duration::from_secs(8);
/// A window that changes its size is left to it for so long before pictures follow.
const SETTLE: Duration = Duration::from_millis(120);
/// Pixels of smooth scrolling that count as one notch.
const NOTCH_PIXELS: f64 = 40.0;
/// Smallest size of a picture.
const SMALLEST: u32 = 16;

/// Opens a window on `world` and returns when it is closed.
///
/// `stop` is asked in every frame: once it says true, the view ends as if the user had closed the window. All threads that
/// the view started have ended or been told to when this returns; a finished picture that was being made is given up.
///
/// # Errors
/// [`ViewError`]: what [`Engine::new`] refuses, and a system without a display.
pub fn view(
    world: Arc<World>,
    camera: Camera,
    viewport: Viewport,
    shaders: Vec<ShaderChoice>,
    settings: ViewSettings,
    stop: &dyn Fn() -> bool,
) -> Result<ViewReport, ViewError> {
    let failed = |error: &dyn std::fmt::Display| ViewError::Window(error.to_string());
    // Before any work: without a display there is nothing to do.
    let events = EventLoop::new().map_err(|error| failed(&error))?;
    let title = format!("llsr - {}", settings.title);
    let engine = Engine::new(world, camera, viewport, shaders, settings)?;
    let mut app = App {
        engine,
        title,
        stop,
        screen: None,
        failure: None,
        last: None,
        next: Instant::now(),
        touched: Instant::now(),
        resized: None,
    };
    events.run_app(&mut app).map_err(|error| failed(&error))?;
    match app.failure {
        Some(what) => Err(ViewError::Window(what)),
        None => Ok(app.engine.report()),
    }
}

type Screen = Surface<Rc<Window>, Rc<Window>>;

struct App<'a> {
    engine: Engine,
    title: String,
    stop: &'a dyn Fn() -> bool,
    screen: Option<Screen>,
    failure: Option<String>,
    /// When the last frame began.
    last: Option<Instant>,
    next: Instant,
    /// When there was input last.
    touched: Instant,
    /// The size that pictures are to take, and since when it stands.
    resized: Option<(Viewport, Instant)>,
}

impl App<'_> {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<Screen, String> {
        let (width, height) = self.engine.canvas().size();
        let attributes = Window::default_attributes()
            .with_title(&self.title)
            .with_inner_size(PhysicalSize::new(width, height))
            .with_min_inner_size(PhysicalSize::new(SMALLEST, SMALLEST));
        let window = Rc::new(events.create_window(attributes).map_err(|e| e.to_string())?);
        let context = Context::new(Rc::clone(&window)).map_err(|e| e.to_string())?;
        Surface::new(&context, window).map_err(|e| e.to_string())
    }

    /// Copies the picture to the screen: centred while the window has another size.
    fn show(&mut self) {
        let Some(screen) = &mut self.screen else { return };
        if let Err(error) = blit(screen, &self.engine) {
            self.failure = Some(error.to_string());
            return;
        }
        self.engine.shown_on_screen();
    }

    fn frame(&mut self, now: Instant) {
        if let Some((viewport, since)) = self.resized
            && now - since >= SETTLE
        {
            self.resized = None;
            self.engine.resize(viewport);
        }
        let seconds = self.last.map_or(0.0, |last| (now - last).as_secs_f64());
        self.last = Some(now);
        self.engine.frame(seconds);
        self.show();
    }
}

fn blit(screen: &mut Screen, engine: &Engine) -> Result<(), softbuffer::SoftBufferError> {
    let size = screen.window().inner_size();
    let (Some(width), Some(height)) = (NonZeroU32::new(size.width), NonZeroU32::new(size.height)) else {
        return Ok(());
    };
    screen.resize(width, height)?;
    let mut buffer = screen.buffer_mut()?;
    let canvas = engine.canvas();
    let (from, to) = (canvas.size(), (size.width, size.height));
    if from == to {
        buffer.copy_from_slice(canvas.pixels());
    } else {
        buffer.fill(0);
        let (x, y) = (
            (i64::from(to.0) - i64::from(from.0)) / 2,
            (i64::from(to.1) - i64::from(from.1)) / 2,
        );
        let left = x.max(0) as usize;
        let columns = (from.0.min(to.0)) as usize;
        let skipped = (-x).max(0) as usize;
        for row in 0..from.1.min(to.1) as usize {
            let (source, target) = (row + (-y).max(0) as usize, row + y.max(0) as usize);
            let source = &canvas.pixels()[source * from.0 as usize + skipped..][..columns];
            buffer[target * to.0 as usize + left..][..columns].copy_from_slice(source);
        }
    }
    buffer.present()
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.screen.is_none() {
            match self.open(events) {
                Ok(screen) => self.screen = Some(screen),
                Err(error) => {
                    self.failure = Some(error);
                    events.exit();
                }
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let mut touched = true;
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => events.exit(),
            WindowEvent::RedrawRequested => {
                touched = false;
                if self.last.is_some() {
                    self.show();
                }
            }
            WindowEvent::Resized(size) if size.width > 0 && size.height > 0 => {
                let viewport = Viewport {
                    width: size.width.max(SMALLEST),
                    height: size.height.max(SMALLEST),
                };
                self.resized = Some((viewport, Instant::now()));
            }
            WindowEvent::Focused(false) => self.engine.release_all(),
            WindowEvent::KeyboardInput { event, .. } if !event.repeat => {
                if let PhysicalKey::Code(code) = event.physical_key {
                    // The names of winit's codes are those of the W3C.
                    self.engine
                        .key(&format!("{code:?}"), event.state == ElementState::Pressed);
                }
            }
            WindowEvent::CursorMoved { position, .. } => {
                // The picture is in the middle of a window of another size.
                let (width, height) = self.engine.canvas().size();
                let size = self.screen.as_ref().map(|screen| screen.window().inner_size());
                let size = size.unwrap_or(PhysicalSize::new(width, height));
                let offset = |window: u32, picture: u32| (f64::from(window) - f64::from(picture)) / 2.0;
                let (x, y) = (offset(size.width, width), offset(size.height, height));
                self.engine.pointer(position.x - x, position.y - y);
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let button = match button {
                    MouseButton::Left => Button::Left,
                    MouseButton::Middle => Button::Middle,
                    MouseButton::Right => Button::Right,
                    _ => return,
                };
                self.engine.button(button, state == ElementState::Pressed);
            }
            WindowEvent::MouseWheel { delta, .. } => self.engine.wheel(match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                MouseScrollDelta::PixelDelta(pixels) => pixels.y / NOTCH_PIXELS,
            }),
            _ => touched = false,
        }
        if touched {
            self.touched = Instant::now();
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.engine.wants_to_quit() || self.failure.is_some() || (self.stop)() {
            events.exit();
            return;
        }
        let now = Instant::now();
        if now >= self.next && self.screen.is_some() {
            self.frame(now);
            let pause = if self.touched.elapsed() > IDLE_AFTER {
                IDLE_FRAME
            } else {
                FRAME
            };
            self.next = now + pause;
        }
        events.set_control_flow(ControlFlow::WaitUntil(self.next));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The surface goes before the display does.
        self.screen = None;
    }
}
