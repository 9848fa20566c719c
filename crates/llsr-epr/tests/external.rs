//! Shaders in other programs: in-memory peers that behave well and badly, and the reference client if there is a Python.

use std::io::{self, BufRead, BufReader, PipeReader, PipeWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use glam::{DVec3, Vec3};
use llsr_epr::{ExternalSettings, ExternalShader, Harvest, PROTOCOL, Peer, PoolSettings, ShaderPool};
use llsr_scene::{LightId, ObjectId, Scene, Viewport, demo};
use llsr_shading::{
    DirectShader, Encounters, Place, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch, World,
};

const LONG: Duration = Duration::from_secs(60);

fn world(name: &str, movable: &[ObjectId]) -> Arc<World> {
    let scene = demo::build(name).expect("built in");
    Arc::new(World::new(Arc::new(scene), movable).0)
}

fn requests(scene: &Scene, width: u32, height: u32) -> Vec<ShadeRequest> {
    let viewport = Viewport { width, height };
    (0..viewport.pixels() as u64)
        .map(|index| {
            let (x, y) = (index as u32 % width, index as u32 / width);
            let (origin, direction) = scene.cameras[0].ray(viewport, f64::from(x) + 0.4, f64::from(y) + 0.6);
            ShadeRequest {
                // Not the number in the batch.
                id: 1000 + 7 * index,
                origin,
                direction: direction * 3.0,
            }
        })
        .collect()
}

fn shade(shader: &dyn Shader, rays: &[ShadeRequest]) -> Result<(Vec<ShadedPoint>, Encounters), ShaderError> {
    let (mut points, mut met) = (Vec::new(), Encounters::default());
    shader.shade(rays, 5, &mut ShaderScratch::default(), &mut points, &mut met)?;
    Ok((points, met))
}

/// A peer that is a thread of the test; `each` gets the number of the start.
type Life = dyn Fn(u32, BufReader<PipeReader>, PipeWriter) + Send + Sync;

fn over(
    world: &Arc<World>,
    settings: &ExternalSettings,
    life: impl Fn(u32, BufReader<PipeReader>, PipeWriter) + Send + Sync + 'static,
) -> Result<ExternalShader, ShaderError> {
    let life: Arc<Life> = Arc::new(life);
    let starts = AtomicU32::new(0);
    let connect = move || -> io::Result<Peer> {
        let ((theirs_in, ours_out), (ours_in, theirs_out)) = (io::pipe()?, io::pipe()?);
        let life = Arc::clone(&life);
        let start = starts.fetch_add(1, Ordering::SeqCst);
        std::thread::spawn(move || life(start, BufReader::new(theirs_in), theirs_out));
        Ok(Peer {
            requests: Box::new(ours_out),
            answers: Box::new(ours_in),
            end: Box::new(|| {}),
        })
    };
    ExternalShader::over("peer", Box::new(connect), Arc::clone(world), settings)
}

fn quick() -> ExternalSettings {
    ExternalSettings {
        scene: "demo:wall".into(),
        start_timeout: LONG,
        batch_timeout: LONG,
        ..ExternalSettings::default()
    }
}

/// Reads up to the line that begins with `word` and returns all lines.
fn read_to(from: &mut impl BufRead, word: &str) -> Option<Vec<String>> {
    let mut lines = Vec::new();
    loop {
        let mut line = String::new();
        if from.read_line(&mut line).ok()? == 0 {
            return None;
        }
        let found = line.starts_with(word);
        lines.push(line.trim_end().to_owned());
        if found {
            return Some(lines);
        }
    }
}

fn greet(from: &mut impl BufRead, to: &mut impl Write) {
    read_to(from, "start").expect("a whole greeting");
    writeln!(to, "llsr-shader {PROTOCOL} a peer").expect("somebody listens");
}

/// Reads a batch: its number and the rays.
fn read_batch(from: &mut impl BufRead) -> Option<(String, Vec<ShadeRequest>, Vec<String>)> {
    let mut lines = read_to(from, "shade")?;
    let head = lines.pop()?;
    let mut fields = head.split(' ').skip(1);
    let (batch, count) = (fields.next()?.to_owned(), fields.next()?.parse().ok()?);
    let mut rays = Vec::new();
    for index in 0u32..count {
        let line = read_to(from, "ray")?.pop()?;
        let n: Vec<f64> = line
            .split(' ')
            .skip(1)
            .map(|f| f.parse().expect("a number"))
            .collect();
        assert_eq!(n[0], f64::from(index), "rays are numbered");
        rays.push(ShadeRequest {
            id: u64::from(index),
            origin: DVec3::from_slice(&n[1..4]),
            direction: DVec3::from_slice(&n[4..7]),
        });
    }
    Some((batch, rays, lines))
}

/// Answers every batch by a shader of this program, points backwards.
fn serve(shader: &dyn Shader, from: &mut impl BufRead, to: &mut impl Write) {
    while let Some((batch, rays, _)) = read_batch(from) {
        let (points, met) = shade(shader, &rays).expect("good rays");
        let mut text = String::from("# a comment\n\n");
        for p in points.iter().rev() {
            let v = |v: Vec3| format!("{} {} {}", v.x, v.y, v.z);
            match p.object {
                Some(object) => {
                    let numbers = [p.position, p.normal, p.albedo, p.colour].map(v).join(" ");
                    text += &format!("point {} {numbers} {} {}\n", p.id, object.0, p.lights);
                }
                None => text += &format!("miss {} {}\n", p.id, v(p.colour)),
            }
        }
        for t in &met.triples {
            text += &format!("triple {} {} {}\n", t.light.0, t.blocker.0, t.receiver.0);
        }
        text += &format!("done {batch}\n");
        if to.write_all(text.as_bytes()).is_err() {
            return;
        }
    }
}

#[test]
fn a_peer_that_shades_as_we_do_gives_what_we_get() {
    let world = world("sphere-and-friends", &[]);
    let theirs = DirectShader::new(Arc::clone(&world), Vec3::ONE);
    let shader = over(&world, &quick(), move |_, mut from, mut to| {
        greet(&mut from, &mut to);
        serve(&theirs, &mut from, &mut to);
    })
    .expect("it greets");
    let ours = DirectShader::new(Arc::clone(&world), Vec3::ONE);
    for size in [12, 5] {
        let rays = requests(world.scene(), size, size);
        let (mut points, met) = shade(&shader, &rays).expect("it shades");
        points.sort_by_key(|point| point.id);
        let (expected, expected_met) = shade(&ours, &rays).expect("good rays");
        assert_eq!(points.len(), expected.len(), "a point for each");
        for (point, expected) in points.iter().zip(&expected) {
            assert_eq!(
                (point.id, point.object, point.lights),
                (expected.id, expected.object, expected.lights)
            );
            assert!((point.position - expected.position).length() <= 1e-5 * expected.position.length());
            assert!((point.colour - expected.colour).length() <= 1e-5 * expected.colour.length());
        }
        assert_eq!(met, expected_met, "and what was met");
    }
    assert_eq!(shader.starts(), 1, "one program for all batches");
}

#[test]
fn the_scene_is_told_and_what_moves_too() {
    let world = world("sphere-and-friends", &[ObjectId(0)]);
    let heard = Arc::new(Mutex::new(Vec::<Vec<String>>::new()));
    let ears = Arc::clone(&heard);
    let settings = ExternalSettings {
        scene: "my room.glb\nstart".into(),
        view: Some((
            world.scene().cameras[0].clone(),
            Viewport {
                width: 40,
                height: 30,
            },
        )),
        ..quick()
    };
    let shader = over(&world, &settings, move |start, mut from, mut to| {
        let greeting = read_to(&mut from, "start").expect("a greeting");
        ears.lock().expect("unpoisoned").push(greeting);
        writeln!(to, "llsr-shader {PROTOCOL}").expect("somebody listens");
        let mut batches = 0;
        while let Some((batch, _, before)) = read_batch(&mut from) {
            ears.lock().expect("unpoisoned").push(before);
            batches += 1;
            if start == 0 && batches == 3 {
                return;
            }
            if writeln!(to, "done {batch}").is_err() {
                return;
            }
        }
    })
    .expect("it greets");
    let rays = requests(world.scene(), 2, 2);
    let mut light = world.lights()[0].clone();
    light.translate(DVec3::new(0.5, 0.0, 0.0));
    let to = glam::Affine3A::from_translation(Vec3::new(0.25, 0.0, 0.125));
    let change = world
        .moved(&[Place::Object(ObjectId(0), to), Place::Light(LightId(0), light)])
        .expect("good");
    assert_eq!(
        shade(&shader, &rays).expect("no answer is an answer").0.len(),
        0,
        "nothing comes back"
    );
    shader.changed(&change);
    shade(&shader, &rays).expect("told");
    assert!(shade(&shader, &rays).is_err(), "the third batch ends it");
    shade(&shader, &rays).expect("started again");
    let heard = heard.lock().expect("unpoisoned");
    let greeting = &heard[0];
    assert_eq!(greeting[0], "llsr-shader 1", "the version comes first");
    assert_eq!(greeting[1], "scene my room.glbstart", "a name of one line");
    assert!(
        greeting.iter().any(|line| line.starts_with("light 0 ")),
        "{greeting:?}"
    );
    assert!(
        greeting.iter().any(|line| line.starts_with("view 40 30 ")),
        "{greeting:?}"
    );
    assert!(heard[1].is_empty(), "nothing has moved yet: {:?}", heard[1]);
    assert_eq!(
        heard[2][0], "object 0 1 0 0 0 1 0 0 0 1 0.25 0 0.125",
        "the object"
    );
    assert!(
        heard[2][1].starts_with("light 0 ") && heard[2].len() == 2,
        "and the light: {:?}",
        heard[2]
    );
    assert!(heard[3].is_empty(), "told once");
    assert_eq!(heard[4], *greeting, "a new start is told the scene");
    assert_eq!(heard[5], heard[2], "and what has moved");
}

/// One bad deed in the first batch; every other batch is answered well.
fn misbehaves(deed: impl Fn(&str, &mut PipeWriter) + Send + Sync + 'static, expected: &str) {
    let world = world("wall", &[]);
    let theirs = DirectShader::new(Arc::clone(&world), Vec3::ONE);
    let settings = ExternalSettings {
        batch_timeout: if expected.contains("in time") {
            Duration::from_millis(100)
        } else {
            LONG
        },
        ..quick()
    };
    let shader = over(&world, &settings, move |start, mut from, mut to| {
        greet(&mut from, &mut to);
        if start == 0 {
            let Some((batch, ..)) = read_batch(&mut from) else {
                return;
            };
            deed(&batch, &mut to);
        }
        serve(&theirs, &mut from, &mut to);
    })
    .expect("it greets");
    let rays = requests(world.scene(), 3, 3);
    match shade(&shader, &rays) {
        Err(ShaderError::External(error)) => assert!(error.contains(expected), "'{error}' says '{expected}'"),
        other => panic!("{expected}: {other:?}"),
    }
    let (points, _) = shade(&shader, &rays).expect("the next start behaves");
    assert_eq!((points.len(), shader.starts()), (9, 2), "{expected}");
}

#[test]
fn bad_answers_cost_their_batch() {
    let say = |text: &'static str| {
        move |batch: &str, to: &mut PipeWriter| {
            let _ = write!(to, "{}", text.replace('B', batch));
        }
    };
    misbehaves(say("lorem ipsum\n"), "makes no sense");
    misbehaves(
        say("point 0 1 2 3 0 1 0 1 1 1 1 1 1 0 1\npoint 0 1 2 3 0 1 0 1 1 1 1 1 1 0 1\n"),
        "twice",
    );
    misbehaves(say("point 9 1 2 3 0 1 0 1 1 1 1 1 1 0 1\n"), "ray 9");
    misbehaves(say("point 0 nan 2 3 0 1 0 1 1 1 1 1 1 0 1\n"), "not finite");
    misbehaves(say("triple 0 0 7\n"), "object 7");
    misbehaves(say("done B1\n"), "ended batch");
    misbehaves(say("llsr-shader 1\n"), "greeted");
    misbehaves(say("failed out of coffee\n"), "out of coffee");
    misbehaves(say(""), "in time");
    misbehaves(
        |_, to| {
            // Far more than any buffer holds, without an end of line.
            let chunk = [b'7'; 4096];
            for _ in 0..2000 {
                if to.write_all(&chunk).is_err() {
                    return;
                }
            }
        },
        "more than 1024 bytes",
    );
    misbehaves(
        |_, to| {
            // Harmless lines without end: they are passed over until time is up.
            while to.write_all(b"# still thinking\n").is_ok() {}
        },
        "in time",
    );
}

#[test]
fn a_peer_that_dies_is_started_again_and_given_up_in_the_end() {
    let world = world("wall", &[]);
    let shader = over(&world, &quick(), |_, mut from, mut to| {
        greet(&mut from, &mut to);
        read_batch(&mut from);
        let _ = to.write_all(b"point 0 1 2");
    })
    .expect("it greets");
    let rays = requests(world.scene(), 3, 3);
    for attempt in 0..4 {
        let error = shade(&shader, &rays)
            .expect_err("it dies in each batch")
            .to_string();
        assert!(error.contains("middle of a line"), "{attempt}: {error}");
    }
    for _ in 0..3 {
        let error = shade(&shader, &rays)
            .expect_err("it is not started any more")
            .to_string();
        let (count, reason) = ("failed 4 times", "middle of a line");
        assert!(error.contains("given up"), "{error}");
        assert!(error.contains(count) && error.contains(reason), "{error}");
    }
    assert_eq!(shader.starts(), 4, "the first and three more");
}

#[test]
fn who_waits_for_a_peer_can_be_told_to_stop() {
    static STOP: AtomicBool = AtomicBool::new(false);
    let settings = ExternalSettings {
        stop: Some(|| STOP.load(Ordering::SeqCst)),
        ..quick()
    };
    let world = world("wall", &[]);
    let shader = over(&world, &settings, |_, mut from, mut to| {
        greet(&mut from, &mut to);
        read_batch(&mut from);
        STOP.store(true, Ordering::SeqCst);
        // Silent, until nobody speaks to it any more.
        read_to(&mut from, "never");
    })
    .expect("it greets");
    let rays = requests(world.scene(), 2, 2);
    for attempt in 0..2 {
        let start = Instant::now();
        let error = shade(&shader, &rays).expect_err("stopped").to_string();
        assert!(error.contains("stopped"), "{attempt}: {error}");
        assert!(start.elapsed() < LONG / 2, "not when its time is up");
    }
    assert_eq!(shader.starts(), 1, "it is not started again");
}

#[test]
fn what_does_not_greet_is_not_used() {
    let world = world("wall", &[]);
    let begin = |text: &'static str| {
        over(&world, &quick(), move |_, mut from, mut to| {
            read_to(&mut from, "start");
            let _ = to.write_all(text.as_bytes());
        })
        .map(|_| ())
        .expect_err(text)
        .to_string()
    };
    assert!(
        begin("llsr-shader 2 from the future\n").contains("version 2"),
        "another version"
    );
    assert!(begin("done 1\n").contains("greeting"), "something else");
    assert!(begin("Welcome!\n").contains("makes no sense"), "a banner");
    assert!(begin("").contains("ended"), "nothing");
    let settings = ExternalSettings {
        start_timeout: Duration::from_millis(50),
        ..quick()
    };
    let silent = over(&world, &settings, |_, mut from, to| {
        // Listens and says nothing, until it is hung up on.
        let _ = io::copy(&mut from, &mut io::sink());
        drop(to);
    });
    assert!(
        silent.expect_err("silence").to_string().contains("in time"),
        "too slow"
    );
    let refused = ExternalShader::over(
        "peer",
        Box::new(|| Err(io::Error::other("no such thing"))),
        Arc::clone(&world),
        &quick(),
    );
    assert!(
        refused
            .expect_err("no peer")
            .to_string()
            .contains("no such thing"),
        "the cause is told"
    );
    for command in ["", "'", "./no-such-program-anywhere --x"] {
        let error = ExternalShader::spawn(command, Arc::clone(&world), &quick());
        assert!(
            matches!(error, Err(ShaderError::External(_))),
            "{command}: {error:?}"
        );
    }
}

#[test]
fn a_pool_goes_on_around_a_dying_program() {
    let world = world("wall", &[]);
    let theirs = DirectShader::new(Arc::clone(&world), Vec3::ONE);
    let settings = ExternalSettings {
        restarts: 100,
        ..quick()
    };
    let shader = over(&world, &settings, move |start, mut from, mut to| {
        greet(&mut from, &mut to);
        if start % 2 == 0 {
            read_batch(&mut from);
            return;
        }
        let mut served = 0;
        while served < 2
            && let Some((batch, ..)) = read_batch(&mut from)
        {
            served += 1;
            let _ = writeln!(to, "miss 0 1 2 3\ndone {batch}");
        }
        let _ = &theirs;
    })
    .expect("it greets");
    let pool = ShaderPool::new(Arc::new(shader), &PoolSettings::default()).expect("a thread");
    let rays = requests(world.scene(), 16, 16);
    pool.submit(&rays);
    assert!(pool.wait_idle(LONG), "{pool:?}");
    let status = pool.status();
    // Batches of 16: one dies, two are answered by one point each, the next dies, and so on.
    assert_eq!(status.counts.shaded + status.counts.errors, 16, "{status:?}");
    assert!(
        status.counts.shaded >= 8 && status.counts.errors >= 4,
        "{status:?}"
    );
    let mut harvest = Harvest::default();
    pool.collect(&mut harvest);
    assert!(
        harvest
            .fresh
            .iter()
            .all(|point| point.colour == Vec3::new(1.0, 2.0, 3.0)),
        "backgrounds"
    );
}

#[test]
fn stopping_does_not_wait_for_an_answer() {
    let world = world("wall", &[]);
    let gate = Arc::new(Mutex::new(None::<PipeWriter>));
    let inside = Arc::clone(&gate);
    let shader = over(&world, &quick(), move |_, mut from, mut to| {
        greet(&mut from, &mut to);
        read_batch(&mut from);
        // Keeps its end open and says nothing; what ends it is below.
        *inside.lock().expect("unpoisoned") = Some(to);
    })
    .expect("it greets");
    let shader = Arc::new(shader);
    let pool =
        ShaderPool::new(Arc::clone(&shader) as Arc<dyn Shader>, &PoolSettings::default()).expect("a thread");
    pool.submit(&requests(world.scene(), 4, 4));
    while gate.lock().expect("unpoisoned").is_none() {
        std::thread::yield_now();
    }
    // An in-memory peer is not ended by force, so the answer's end is closed here, as a killed program's is.
    let closer = std::thread::spawn(move || drop(gate.lock().expect("unpoisoned").take()));
    drop(pool);
    closer.join().expect("no panic");
    let error = shade(&*shader, &requests(world.scene(), 1, 1))
        .expect_err("it was stopped")
        .to_string();
    assert!(error.contains("was stopped"), "{error}");
}

/// A Python 3, if there is one.
fn python() -> Option<&'static str> {
    let works = |name: &&str| {
        let mut run = Command::new(name);
        run.args(["-c", "import sys; sys.exit(sys.version_info < (3, 6))"])
            .stderr(Stdio::null());
        run.status().is_ok_and(|status| status.success())
    };
    let found = ["python3", "python"].into_iter().find(works);
    if found.is_none() {
        println!("skipped: there is no Python 3 here");
    }
    found
}

#[test]
fn the_reference_client_agrees_with_direct_light() {
    let Some(python) = python() else { return };
    let client = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/shader/wall.py");
    let world = world("wall", &[]);
    let command = format!("{python} '{}'", client.display());
    let shader = ExternalShader::spawn(&command, Arc::clone(&world), &quick()).expect("it greets");
    let ours = DirectShader::new(Arc::clone(&world), Vec3::ZERO);
    let rays = requests(world.scene(), 16, 16);
    let (points, met) = shade(&shader, &rays).expect("it shades");
    let (again, _) = shade(&shader, &rays[100..120]).expect("it shades");
    assert_eq!(points[100..120], again, "the same rays, the same colours");
    let (expected, expected_met) = shade(&ours, &rays).expect("good rays");
    let (mut difference, mut sum) = (0.0, 0.0);
    for (point, expected) in points.iter().zip(&expected) {
        assert_eq!(
            (point.id, point.object),
            (expected.id, expected.object),
            "the same surface"
        );
        difference += (point.colour.y - expected.colour.y).abs();
        sum += expected.colour.y;
    }
    // Sixteen random places on a long light: 3.4 percent.
    assert!(difference < 0.05 * sum, "{difference} of {sum}");
    assert_eq!(met.objects, expected_met.objects, "the objects seen");
    assert!(
        !met.triples.is_empty() && expected_met.triples.iter().all(|t| met.triples.contains(t)),
        "{met:?}"
    );
}

#[test]
fn a_program_killed_in_mid_run_is_reported_and_replaced() {
    let Some(python) = python() else { return };
    let world = world("wall", &[]);
    // Kills itself in each third batch, without a word.
    let script = "
import os, signal, sys
batches = 0
for line in sys.stdin:
    word, *fields = line.split()
    if word == 'start':
        print('llsr-shader 1', flush=True)
    elif word == 'shade':
        batches += 1
        if batches == 3:
            os.kill(os.getpid(), signal.SIGTERM)
        print('miss 0 1 1 1\\ndone', fields[0], flush=True)
";
    let command = format!("{python} -c \"{script}\"");
    let shader = ExternalShader::spawn(&command, Arc::clone(&world), &quick()).expect("it greets");
    let rays = requests(world.scene(), 2, 2);
    let outcomes: Vec<bool> = (0..9).map(|_| shade(&shader, &rays).is_ok()).collect();
    assert_eq!(
        outcomes,
        [true, true, false, true, true, false, true, true, false],
        "two of three are answered"
    );
    assert_eq!(shader.starts(), 3, "started anew when needed");
}
