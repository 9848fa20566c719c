//! Any other program as shader.
//!
//! The program is started once and spoken to over its standard streams; `docs/shader-protocol.md` has the protocol. What it
//! answers is not trusted: lines have a greatest length, numbers a range, batches a time limit. A program that breaks the
//! rules, falls silent or dies is ended and started again, a few times; each time the batch is lost, and said so.

mod link;
mod protocol;
mod words;

use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use glam::Affine3A;
use llsr_scene::{Camera, Light, LightId, ObjectId, Viewport};
use llsr_shading::{
    Encounters, MovedThing, SceneChange, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch, World,
};

use link::Link;
use protocol::{Answer, Limits, write_batch, write_greeting, write_light, write_object};
pub use protocol::{MAX_LINE, PROTOCOL};
pub use words::split_words;

/// How a program is spoken to.
#[derive(Clone, Debug)]
pub struct ExternalSettings {
    /// The scene as the user named it: a file, or `demo:NAME`.
    pub scene: String,
    /// The camera and the size of the picture to begin with, for programs that prepare something for them.
    pub view: Option<(Camera, Viewport)>,
    /// How long the program may take to greet; it may load the scene in that time. Time in which this process is stopped does not count,
    /// here and for a batch.
    pub start_timeout: Duration,
    /// How long it may take for a batch.
    pub batch_timeout: Duration,
    /// How often in a row it is started again after a failure.
    pub restarts: u32,
    /// Asked some times a second while the program is waited for: true ends the conversation for good, as
    /// [`Shader::interrupt`] does. For callers that wait themselves.
    pub stop: Option<fn() -> bool>,
}

/// Time between two looks at whether to stop.
const LOOK: Duration = Duration::from_millis(50);

impl Default for ExternalSettings {
    /// No scene, no view, 60 seconds to start, 30 for a batch, three restarts.
    fn default() -> Self {
        Self {
            scene: String::new(),
            view: None,
            start_timeout: Duration::from_secs(60),
            batch_timeout: Duration::from_secs(30),
            restarts: 3,
            stop: None,
        }
    }
}

/// The two ends of a conversation with a shader, and how to end it by force.
pub struct Peer {
    /// Where requests go.
    pub requests: Box<dyn Write + Send>,
    /// Where answers come from.
    pub answers: Box<dyn Read + Send>,
    /// Ends the peer: both streams must end soon afterwards. Called once.
    pub end: Box<dyn FnOnce() + Send>,
}

impl std::fmt::Debug for Peer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Peer").finish_non_exhaustive()
    }
}

/// Makes a new peer, at first and after each failure.
type Connect = Box<dyn Fn() -> io::Result<Peer> + Send + Sync>;

/// A shader that is another program.
///
/// One batch is on its way at a time, so a pool has no use for more than one thread with it.
pub struct ExternalShader {
    name: String,
    settings: ExternalSettings,
    world: Arc<World>,
    connect: Connect,
    conversation: Mutex<Conversation>,
    moved: Mutex<Moved>,
    /// Ends the peer, from any thread.
    end: Mutex<Option<Box<dyn FnOnce() + Send>>>,
    interrupted: AtomicBool,
    starts: AtomicU32,
}

#[derive(Default)]
struct Conversation {
    link: Option<Link>,
    /// Failures since the last batch that went well.
    failures: u32,
    /// It is not started any more; what to say.
    given_up: Option<String>,
    batch: u64,
}

/// Where things stand that have moved, and which of them the peer has not been told yet.
#[derive(Default)]
struct Moved {
    objects: BTreeMap<ObjectId, (Affine3A, bool)>,
    lights: BTreeMap<LightId, (Light, bool)>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl std::fmt::Debug for ExternalShader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ExternalShader")
            .field("name", &self.name)
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}

impl ExternalShader {
    /// Starts `command` and waits for its greeting. The command is split into words as a shell would, with quotes and
    /// backslashes; nothing else of a shell is there. Its standard error stays the caller's.
    ///
    /// # Errors
    /// [`ShaderError::External`] if the command is empty or has an open quote, cannot be started, or does not greet in time.
    pub fn spawn(command: &str, world: Arc<World>, settings: &ExternalSettings) -> Result<Self, ShaderError> {
        let words = split_words(command).map_err(ShaderError::External)?;
        let connect = move || {
            let mut child = Command::new(&words[0])
                .args(&words[1..])
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()?;
            match (child.stdin.take(), child.stdout.take()) {
                (Some(requests), Some(answers)) => Ok(Peer {
                    requests: Box::new(requests),
                    answers: Box::new(answers),
                    end: Box::new(move || end_child(child)),
                }),
                _ => Err(io::Error::other("the streams are missing")),
            }
        };
        Self::over(command, Box::new(connect), world, settings)
    }

    /// Speaks to whatever `connect` makes, over whatever streams, and waits for its greeting. `name` is for messages.
    ///
    /// # Errors
    /// [`ShaderError::External`] if `connect` fails or there is no greeting in time.
    pub fn over(
        name: &str,
        connect: Box<dyn Fn() -> io::Result<Peer> + Send + Sync>,
        world: Arc<World>,
        settings: &ExternalSettings,
    ) -> Result<Self, ShaderError> {
        let shader = Self {
            name: name.to_owned(),
            settings: settings.clone(),
            world,
            connect,
            conversation: Mutex::default(),
            moved: Mutex::default(),
            end: Mutex::default(),
            interrupted: AtomicBool::new(false),
            starts: AtomicU32::new(0),
        };
        let link = shader.start().map_err(ShaderError::External)?;
        lock(&shader.conversation).link = Some(link);
        Ok(shader)
    }

    /// How often the program has been started, the first time included.
    pub fn starts(&self) -> u32 {
        self.starts.load(Ordering::Relaxed)
    }

    /// Starts the program and exchanges greetings.
    fn start(&self) -> Result<Link, String> {
        self.starts.fetch_add(1, Ordering::Relaxed);
        let peer = (self.connect)().map_err(|error| format!("cannot be started: {error}"))?;
        *lock(&self.end) = Some(peer.end);
        if self.interrupted.load(Ordering::SeqCst) {
            self.end_peer();
        }
        let link =
            Link::new(peer.requests, peer.answers).map_err(|error| format!("no threads for it: {error}"))?;
        let mut text = Vec::new();
        {
            let mut moved = lock(&self.moved);
            write_greeting(&mut text, &self.world, &self.settings);
            for told in moved.all() {
                *told = false;
            }
        }
        let greeting = self.exchange(&link, text, self.settings.start_timeout, |answer| match answer {
            Answer::Greeting { version } if version == PROTOCOL => Ok(true),
            Answer::Greeting { version } => Err(format!("speaks version {version}, not {PROTOCOL}")),
            _ => Err("did not begin with a greeting".to_owned()),
        });
        match greeting {
            Ok(()) => Ok(link),
            Err(error) => {
                self.end_peer();
                Err(error)
            }
        }
    }

    /// Sends `text` and hands answers to `each` until it returns true.
    fn exchange(
        &self,
        link: &Link,
        text: Vec<u8>,
        timeout: Duration,
        mut each: impl FnMut(Answer) -> Result<bool, String>,
    ) -> Result<(), String> {
        let mut patience = Patience::new(timeout, Instant::now());
        link.send(text)?;
        loop {
            // What came while time ran out still counts.
            let answer = link.receive(patience.left.min(LOOK));
            let patient = patience.goes_on(Instant::now());
            if self.stopped() {
                return Err("was stopped".to_owned());
            }
            if let Some(answer) = answer?
                && each(answer)?
            {
                return Ok(());
            }
            if !patient {
                return Err("did not answer in time".to_owned());
            }
        }
    }

    fn stopped(&self) -> bool {
        self.interrupted.load(Ordering::SeqCst) || self.settings.stop.is_some_and(|stop| stop())
    }

    fn end_peer(&self) {
        let end = lock(&self.end).take();
        if let Some(end) = end {
            end();
        }
    }

    fn batch(
        &self,
        conversation: &mut Conversation,
        requests: &[ShadeRequest],
        seed: u64,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), String> {
        if self.stopped() {
            return Err("was stopped".to_owned());
        }
        if let Some(words) = &conversation.given_up {
            return Err(words.clone());
        }
        if conversation.link.is_none() {
            conversation.link = Some(self.start()?);
        }
        let Some(link) = &conversation.link else {
            return Err("is not there".to_owned());
        };
        conversation.batch += 1;
        let batch = conversation.batch;
        let mut text = Vec::with_capacity(256 + 160 * requests.len());
        lock(&self.moved).tell(&mut text);
        write_batch(&mut text, batch, seed, requests);
        let limits = Limits {
            requests: requests.len() as u64,
            objects: self.world.scene().objects.len() as u32,
            lights: self.world.lights().len() as u32,
        };
        let mut answered = vec![false; requests.len()];
        let before = points.len();
        self.exchange(link, text, self.settings.batch_timeout, |answer| {
            answer.check(&limits)?;
            match answer {
                Answer::Greeting { .. } => return Err("greeted in the middle of a batch".to_owned()),
                Answer::Point(mut point) => {
                    let index = point.id as usize;
                    if std::mem::replace(&mut answered[index], true) {
                        return Err(format!("answered ray {index} twice"));
                    }
                    point.id = requests[index].id;
                    points.push(point);
                }
                Answer::Miss { ray, colour } => {
                    let index = ray as usize;
                    if std::mem::replace(&mut answered[index], true) {
                        return Err(format!("answered ray {index} twice"));
                    }
                    points.push(self.background(&requests[index], colour));
                }
                Answer::Object(object) => met.objects.push(object),
                Answer::Triple(triple) => met.triples.push(triple),
                Answer::Done { batch: done } if done == batch => return Ok(true),
                Answer::Done { batch: done } => return Err(format!("ended batch {done}, not {batch}")),
                Answer::Failed { message } => return Err(format!("says: {message}")),
            }
            // Encounters have no number of their own; of a flood of them one of each is enough.
            if met.objects.len() + met.triples.len() > 1 << 16 {
                met.settle();
                if met.objects.len() + met.triples.len() > 1 << 15 {
                    return Err("reports more encounters than can be".to_owned());
                }
            }
            Ok(false)
        })?;
        for point in &points[before..] {
            met.objects.extend(point.object);
        }
        met.settle();
        Ok(())
    }

    fn background(&self, request: &ShadeRequest, colour: glam::Vec3) -> ShadedPoint {
        let direction = request.direction.normalize_or_zero();
        ShadedPoint {
            textured: None,
            id: request.id,
            position: self.world.background(request.origin, direction).as_vec3(),
            normal: (-direction).as_vec3(),
            albedo: glam::Vec3::ZERO,
            colour,
            object: None,
            lights: 0,
            provisional: false,
        }
    }
}

/// How much longer to wait. Only time in which the waiting itself went on counts: two looks that lie far apart say that this process was
/// stopped, or the whole machine, and the other one with it.
#[derive(Debug)]
struct Patience {
    left: Duration,
    looked: Instant,
}

impl Patience {
    /// What may pass between two looks and count (see [`LOOK`]); of more, so much does.
    const MOST: Duration = Duration::from_millis(100);

    fn new(all: Duration, now: Instant) -> Self {
        Self {
            left: all,
            looked: now,
        }
    }

    /// Is there time left at a look?
    fn goes_on(&mut self, now: Instant) -> bool {
        let passed = now.saturating_duration_since(self.looked).min(Self::MOST);
        self.left = self.left.saturating_sub(passed);
        self.looked = now;
        !self.left.is_zero()
    }
}

/// Kills a program, or finds it dead. Its streams are closed by whoever holds them.
fn end_child(mut child: Child) {
    // Reaped too, so that none is left as a zombie.
    let _ = child.kill();
    let _ = child.wait();
}

impl Moved {
    /// Whether each thing has been told.
    fn all(&mut self) -> impl Iterator<Item = &mut bool> {
        let objects = self.objects.values_mut().map(|(_, told)| told);
        objects.chain(self.lights.values_mut().map(|(_, told)| told))
    }

    /// Writes what the peer does not know yet.
    fn tell(&mut self, text: &mut Vec<u8>) {
        for (object, (transform, told)) in &mut self.objects {
            if !std::mem::replace(told, true) {
                write_object(text, *object, transform);
            }
        }
        for (light, (value, told)) in &mut self.lights {
            if !std::mem::replace(told, true) {
                write_light(text, *light, value);
            }
        }
    }
}

impl Shader for ExternalShader {
    fn name(&self) -> &str {
        &self.name
    }

    fn shade(
        &self,
        requests: &[ShadeRequest],
        seed: u64,
        _: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), ShaderError> {
        for request in requests {
            let usable = request.origin.is_finite() && request.direction.try_normalize().is_some();
            if !usable {
                return Err(ShaderError::BadRay { id: request.id });
            }
        }
        let mut conversation = lock(&self.conversation);
        let done = self.batch(&mut conversation, requests, seed, points, met);
        match &done {
            Ok(()) => conversation.failures = 0,
            Err(error) => {
                // Whatever it does next would be out of step.
                conversation.link = None;
                self.end_peer();
                let failures = conversation.failures.saturating_add(1);
                conversation.failures = failures;
                if failures > self.settings.restarts && conversation.given_up.is_none() {
                    let words = format!(
                        "failed {failures} times in a row and was given up; the last time it {error}"
                    );
                    conversation.given_up = Some(words);
                }
            }
        }
        done.map_err(ShaderError::External)
    }

    fn changed(&self, change: &SceneChange) {
        let mut moved = lock(&self.moved);
        for one in &change.moves {
            match one.what {
                MovedThing::Object(object) => {
                    moved
                        .objects
                        .insert(object, (*change.world.transform(object), false));
                }
                MovedThing::Light(light) => {
                    let value = change.world.lights()[light.index()].clone();
                    moved.lights.insert(light, (value, false));
                }
            }
        }
    }

    fn interrupt(&self) {
        self.interrupted.store(true, Ordering::SeqCst);
        self.end_peer();
    }
}

impl Drop for ExternalShader {
    fn drop(&mut self) {
        lock(&self.conversation).link = None;
        self.end_peer();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_time_in_which_it_is_looked_counts() {
        let mut now = Instant::now();
        let mut patience = Patience::new(Duration::from_secs(2), now);
        let mut step = |milliseconds| {
            now += Duration::from_millis(milliseconds);
            patience.goes_on(now)
        };
        assert!((0..39).all(|_| step(50)), "1.95 of 2 seconds");
        assert!(!step(50), "the last of them");
        let mut patience = Patience::new(Duration::from_secs(2), now);
        let mut step = |milliseconds| {
            now += Duration::from_millis(milliseconds);
            patience.goes_on(now)
        };
        assert!(step(3_600_000), "stopped for an hour");
        assert!((0..37).all(|_| step(50)), "which counts as a tenth of a second");
        assert!(!step(50), "and no more");
    }
}
