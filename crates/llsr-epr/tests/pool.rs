//! Pools under shaders that are slow, fail, panic, and return nonsense.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use glam::{DVec3, Vec3};
use llsr_epr::{Harvest, Overflow, PoolSettings, ShaderPool, shade_lockstep};
use llsr_scene::{LightId, ObjectId, Scene, Triple, demo};
use llsr_shading::{
    DirectShader, Encounters, SceneChange, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch,
    World,
};

/// Long enough for anything that ends at all, on a busy machine.
const LONG: Duration = Duration::from_secs(60);

fn request(id: u64) -> ShadeRequest {
    ShadeRequest {
        id,
        origin: DVec3::ZERO,
        direction: DVec3::NEG_Z,
    }
}

fn requests(range: std::ops::Range<u64>) -> Vec<ShadeRequest> {
    range.map(request).collect()
}

fn point(id: u64) -> ShadedPoint {
    ShadedPoint {
        textured: None,
        id,
        position: Vec3::ZERO,
        normal: Vec3::Z,
        albedo: Vec3::ONE,
        colour: Vec3::ONE,
        object: None,
        lights: 0,
        provisional: false,
    }
}

/// A shader that does what it is told; `what` gets the number of the batch.
struct Told<F>(F, AtomicU64);

type Answer = Result<(), ShaderError>;

impl<F: Fn(u64, &[ShadeRequest], &mut Vec<ShadedPoint>) -> Answer + Send + Sync> Shader for Told<F> {
    fn name(&self) -> &str {
        "told"
    }

    fn shade(
        &self,
        requests: &[ShadeRequest],
        _: u64,
        _: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Answer {
        met.objects
            .extend(requests.iter().map(|request| ObjectId((request.id % 5) as u32)));
        met.triples.extend(requests.iter().map(|request| Triple {
            light: LightId(0),
            blocker: ObjectId((request.id % 3) as u32),
            receiver: ObjectId(1),
        }));
        (self.0)(self.1.fetch_add(1, Ordering::Relaxed), requests, points)
    }
}

fn told<F>(what: F) -> Arc<Told<F>> {
    Arc::new(Told(what, AtomicU64::new(0)))
}

fn answer_all(requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>) -> Answer {
    points.extend(requests.iter().map(|request| point(request.id)));
    Ok(())
}

fn pool(shader: Arc<dyn Shader>, threads: usize) -> ShaderPool {
    let settings = PoolSettings {
        threads,
        ..PoolSettings::default()
    };
    ShaderPool::new(shader, &settings).expect("there are threads")
}

#[test]
fn every_request_comes_back_once() {
    let pool = pool(
        told(|_, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| answer_all(requests, points)),
        3,
    );
    let mut harvest = Harvest::default();
    let mut ids = BTreeSet::new();
    let mut met = Encounters::default();
    let mut count = 0;
    for round in 0..50 {
        assert_eq!(
            pool.submit(&requests(round * 100..(round + 1) * 100)),
            0,
            "there is room"
        );
        pool.collect(&mut harvest);
        count += harvest.fresh.len();
        ids.extend(harvest.fresh.iter().map(|point| point.id));
        met.merge(&harvest.met);
    }
    assert!(pool.wait_idle(LONG), "{pool:?}");
    pool.collect(&mut harvest);
    count += harvest.fresh.len();
    ids.extend(harvest.fresh.iter().map(|point| point.id));
    met.merge(&harvest.met);
    assert_eq!((count, ids.len()), (5000, 5000), "each once");
    assert_eq!(
        (met.objects.len(), met.triples.len()),
        (5, 3),
        "all that was met, once"
    );
    let counts = pool.status().counts;
    assert_eq!(
        (counts.requested, counts.shaded, counts.dropped),
        (5000, 5000, 0),
        "{counts:?}"
    );
}

#[test]
fn panics_and_errors_cost_their_batch_and_nothing_else() {
    let shader = told(
        |batch, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| match batch % 3 {
            0 => panic!("batch {batch} is unlucky"),
            1 => {
                points.push(point(requests[0].id));
                Err(ShaderError::External("half way".into()))
            }
            _ => answer_all(requests, points),
        },
    );
    let pool = pool(shader, 2);
    pool.submit(&requests(0..480));
    assert!(pool.wait_idle(LONG), "{pool:?}");
    let status = pool.status();
    let counts = status.counts;
    assert_eq!(
        (counts.panics, counts.errors),
        (10, 10),
        "thirty batches of 16: {counts:?}"
    );
    assert_eq!(
        counts.shaded,
        10 * 16 + 10,
        "whole batches and one point of each that failed: {counts:?}"
    );
    assert_eq!(counts.failed, 10 * 16 + 10 * 15, "{counts:?}");
    assert_eq!(status.threads, 2, "both live");
    let error = status.last_error.expect("something was said");
    assert!(error.contains("unlucky") || error.contains("half way"), "{error}");
}

#[test]
fn a_full_queue_drops_or_refuses() {
    let gate = Arc::new(AtomicBool::new(false));
    for overflow in [Overflow::DropOldest, Overflow::Refuse] {
        gate.store(false, Ordering::SeqCst);
        let inside = Arc::clone(&gate);
        let shader = told(
            move |_, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| {
                while !inside.load(Ordering::SeqCst) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                answer_all(requests, points)
            },
        );
        let settings = PoolSettings {
            queue: 100,
            batch: 10,
            overflow,
            ..PoolSettings::default()
        };
        let pool = ShaderPool::new(shader, &settings).expect("a thread");
        pool.submit(&requests(0..10));
        // The thread takes the first ten; the rest queue up behind.
        while pool.status().in_flight == 0 {
            std::thread::yield_now();
        }
        assert_eq!(pool.submit(&requests(10..90)), 0, "there is room for 80");
        assert_eq!(pool.submit(&requests(90..190)), 80, "and for twenty more");
        assert_eq!(
            pool.submit(&requests(190..490)),
            300,
            "of 300 as many are lost as come"
        );
        assert_eq!(pool.status().waiting, 100, "the queue is full");
        gate.store(true, Ordering::SeqCst);
        assert!(pool.wait_idle(LONG), "{pool:?}");
        let mut harvest = Harvest::default();
        pool.collect(&mut harvest);
        let ids: BTreeSet<u64> = harvest.fresh.iter().map(|point| point.id).collect();
        let expected: BTreeSet<u64> = match overflow {
            Overflow::DropOldest => (0..10).chain(390..490).collect(),
            Overflow::Refuse => (0..110).collect(),
        };
        assert_eq!(ids, expected, "{overflow:?}");
        assert_eq!(pool.status().counts.dropped, 380, "{overflow:?}");
    }
}

#[test]
fn results_that_nobody_collects_are_bounded() {
    let settings = PoolSettings {
        results: 200,
        ..PoolSettings::default()
    };
    let shader =
        told(|_, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| answer_all(requests, points));
    let pool = ShaderPool::new(shader, &settings).expect("a thread");
    for round in 0..10 {
        pool.submit(&requests(round * 100..(round + 1) * 100));
        assert!(pool.wait_idle(LONG), "{pool:?}");
    }
    let mut harvest = Harvest::default();
    pool.collect(&mut harvest);
    let ids: Vec<u64> = harvest.fresh.iter().map(|point| point.id).collect();
    assert_eq!(ids, (800..1000).collect::<Vec<_>>(), "the newest stay");
    assert_eq!(pool.status().counts.lost, 800, "the others are counted");
}

#[test]
fn nonsense_is_left_out() {
    let shader = told(|_, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| {
        answer_all(requests, points)?;
        points[0].colour.x = f32::NAN;
        points[1].position.y = f32::INFINITY;
        points.extend((0..1000).map(|_| point(u64::MAX)));
        Ok(())
    });
    let pool = pool(shader, 1);
    pool.submit(&requests(0..16));
    assert!(pool.wait_idle(LONG), "{pool:?}");
    let mut harvest = Harvest::default();
    pool.collect(&mut harvest);
    let ids: Vec<u64> = harvest.fresh.iter().map(|point| point.id).collect();
    assert_eq!(
        ids,
        (2..16).collect::<Vec<_>>(),
        "what is usable and was asked for"
    );
    assert_eq!(pool.status().counts.unusable, 1002, "{pool:?}");
}

/// A change of a scene without anything in it.
fn change() -> SceneChange {
    let (world, _) = World::new(Arc::new(Scene::new("empty")), &[]);
    world.moved(&[]).expect("nothing moves")
}

#[test]
fn points_begun_before_a_change_are_stale() {
    let (entered, gate) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let (inside, open) = (Arc::clone(&entered), Arc::clone(&gate));
    let shader = told(
        move |batch, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| {
            inside.store(true, Ordering::SeqCst);
            while batch == 1 && !open.load(Ordering::SeqCst) {
                std::thread::sleep(Duration::from_millis(1));
            }
            answer_all(requests, points)
        },
    );
    let pool = pool(shader, 1);
    pool.submit(&requests(0..16));
    assert!(pool.wait_idle(LONG), "{pool:?}");
    entered.store(false, Ordering::SeqCst);
    pool.submit(&requests(16..48));
    while !entered.load(Ordering::SeqCst) {
        std::thread::yield_now();
    }
    pool.changed(&change());
    gate.store(true, Ordering::SeqCst);
    assert!(pool.wait_idle(LONG), "{pool:?}");
    let mut harvest = Harvest::default();
    pool.collect(&mut harvest);
    let ids = |points: &[ShadedPoint]| points.iter().map(|point| point.id).collect::<Vec<_>>();
    assert_eq!(
        ids(&harvest.stale),
        (0..32).collect::<Vec<_>>(),
        "one not collected, one under way"
    );
    assert_eq!(
        ids(&harvest.fresh),
        (32..48).collect::<Vec<_>>(),
        "the batch after it"
    );
    pool.submit(&requests(0..16));
    pool.submit(&requests(16..32));
    pool.wait_idle(LONG);
    pool.forget();
}

/// Panics with something that panics again when it is dropped.
struct Bomb;

impl Drop for Bomb {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            panic!("a payload that explodes");
        }
    }
}

#[test]
fn a_thread_that_dies_is_replaced() {
    let shader = told(
        |batch, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| {
            if batch < 2 {
                std::panic::panic_any(Bomb);
            }
            answer_all(requests, points)
        },
    );
    let pool = pool(shader, 1);
    pool.submit(&requests(0..64));
    assert!(pool.wait_idle(LONG), "{pool:?}");
    let status = pool.status();
    assert_eq!(status.threads, 1, "{status:?}");
    assert_eq!(status.counts.restarts, 2, "{status:?}");
    assert_eq!(
        (status.counts.shaded, status.counts.failed),
        (32, 32),
        "{status:?}"
    );
}

#[test]
fn the_end_waits_for_threads_only_so_long() {
    /// Shades until it is told to stop, or for ever.
    struct Stuck {
        told: AtomicBool,
        listens: bool,
        entered: AtomicBool,
        free: AtomicBool,
    }
    impl Shader for Stuck {
        fn name(&self) -> &str {
            "stuck"
        }
        fn shade(
            &self,
            _: &[ShadeRequest],
            _: u64,
            _: &mut ShaderScratch,
            _: &mut Vec<ShadedPoint>,
            _: &mut Encounters,
        ) -> Answer {
            self.entered.store(true, Ordering::SeqCst);
            let ended =
                || self.listens && self.told.load(Ordering::SeqCst) || self.free.load(Ordering::SeqCst);
            while !ended() {
                std::thread::sleep(Duration::from_millis(1));
            }
            Err(ShaderError::External("stopped".into()))
        }
        fn interrupt(&self) {
            self.told.store(true, Ordering::SeqCst);
        }
    }
    for listens in [true, false] {
        let shader = Arc::new(Stuck {
            told: AtomicBool::new(false),
            listens,
            entered: AtomicBool::new(false),
            free: AtomicBool::new(false),
        });
        let settings = PoolSettings {
            patience: if listens { LONG } else { Duration::from_millis(30) },
            threads: 2,
            ..PoolSettings::default()
        };
        let pool = ShaderPool::new(Arc::clone(&shader) as Arc<dyn Shader>, &settings).expect("threads");
        pool.submit(&requests(0..100));
        while !shader.entered.load(Ordering::SeqCst) {
            std::thread::yield_now();
        }
        drop(pool);
        assert!(shader.told.load(Ordering::SeqCst), "the shader was asked to stop");
        // Threads that did not listen are still there, and hold nothing but the shader.
        assert_eq!(Arc::strong_count(&shader) == 1, listens, "listens: {listens}");
        shader.free.store(true, Ordering::SeqCst);
    }
}

#[test]
fn pools_come_and_go_under_load() {
    for round in 0..60u64 {
        let shader = told(
            move |batch, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| {
                match (batch + round) % 7 {
                    0 => panic!("now and then"),
                    1 => std::thread::sleep(Duration::from_micros(300)),
                    2 => return Err(ShaderError::External("no".into())),
                    _ => {}
                }
                answer_all(requests, points)
            },
        );
        let settings = PoolSettings {
            threads: 1 + (round % 4) as usize,
            queue: 50,
            results: 40,
            batch: 1 + (round % 9) as usize,
            patience: LONG,
            ..PoolSettings::default()
        };
        let pool = ShaderPool::new(shader, &settings).expect("threads");
        let mut harvest = Harvest::default();
        let mut back = 0;
        for frame in 0..20 {
            pool.submit(&requests(frame * 30..(frame + 1) * 30));
            if frame % 5 == round % 5 {
                pool.changed(&change());
            }
            pool.collect(&mut harvest);
            back += harvest.fresh.len() + harvest.stale.len();
        }
        let counts = pool.status().counts;
        assert_eq!(counts.requested, 600, "all are counted");
        assert!(back as u64 + counts.lost <= counts.shaded, "{back} of {counts:?}");
        if round % 2 == 0 {
            assert!(pool.wait_idle(LONG), "{pool:?}");
            let counts = pool.status().counts;
            assert_eq!(
                counts.shaded + counts.failed + counts.dropped,
                600,
                "none is forgotten: {counts:?}"
            );
        }
    }
}

#[test]
fn lockstep_gives_the_same_bits_for_any_number_of_threads() {
    let scene = Arc::new(demo::build("subway").expect("built in"));
    let (world, _) = World::new(Arc::clone(&scene), &[]);
    let shader = DirectShader::new(Arc::new(world), Vec3::ONE);
    let rays: Vec<ShadeRequest> = (0..500u32)
        .map(|id| {
            let viewport = llsr_scene::Viewport {
                width: 25,
                height: 20,
            };
            let (x, y) = (f64::from(id % 25), f64::from(id / 25));
            let (origin, direction) = scene.cameras[0].ray(viewport, x + 0.3, y + 0.7);
            ShadeRequest {
                id: u64::from(id),
                origin,
                direction,
            }
        })
        .collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        let (mut points, mut met) = (Vec::new(), Encounters::default());
        let report = pool.install(|| shade_lockstep(&shader, &rays, 4, &mut points, &mut met));
        assert_eq!(report, llsr_epr::Lockstep::default(), "nothing goes wrong");
        (points, met)
    };
    let (points, met) = run(1);
    assert_eq!(points.len(), 500, "a point each");
    assert!(points.iter().map(|point| point.id).eq(0..500), "in order");
    assert!(!met.triples.is_empty(), "there are shadows");
    for threads in [2, 5] {
        assert_eq!(run(threads), (points.clone(), met.clone()), "{threads} threads");
    }
}

#[test]
fn lockstep_survives_panics_and_errors() {
    let shader =
        told(
            |_, requests: &[ShadeRequest], points: &mut Vec<ShadedPoint>| match requests[0].id / 32 {
                1 => panic!("second chunk"),
                2 => Err(ShaderError::External("third chunk".into())),
                _ => answer_all(requests, points),
            },
        );
    let (mut points, mut met) = (Vec::new(), Encounters::default());
    let report = shade_lockstep(&*shader, &requests(0..128), 0, &mut points, &mut met);
    assert_eq!(
        (report.failed, report.panics, report.errors),
        (64, 1, 1),
        "{report:?}"
    );
    assert!(
        report
            .last_error
            .is_some_and(|error| error.contains("third chunk")),
        "the last in order"
    );
    assert!(
        points.iter().map(|point| point.id).eq((0..32).chain(96..128)),
        "the others are there"
    );
}
