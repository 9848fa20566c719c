//! The few functions of Embree 3 that the comparison needs, loaded at run time.
#![expect(
    unsafe_code,
    reason = "calls into a C library; its ABI is written out here and nowhere else"
)]

use std::ffi::{c_char, c_int, c_uint, c_void};

use glam::Vec3;
use libloading::Library;

type Handle = *mut c_void;

/// `RTCRay`: one ray, aligned as the header asks.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: [f32; 3],
    pub(crate) near: f32,
    pub(crate) direction: [f32; 3],
    time: f32,
    pub(crate) far: f32,
    mask: c_uint,
    id: c_uint,
    flags: c_uint,
}

/// `RTCRayHit`.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
struct RayHit {
    ray: Ray,
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: c_uint,
    geometry: c_uint,
    instance: c_uint,
}

/// `RTCRay8`: a packet in structure-of-arrays form.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
struct Ray8 {
    origin: [[f32; 8]; 3],
    near: [f32; 8],
    direction: [[f32; 8]; 3],
    time: [f32; 8],
    far: [f32; 8],
    mask: [c_uint; 8],
    id: [c_uint; 8],
    flags: [c_uint; 8],
}

#[repr(C, align(32))]
struct Valid([c_int; 8]);

/// `RTCIntersectContext`, as compiled without minimum widths and with one level of instances.
#[repr(C)]
struct Context {
    flags: c_int,
    filter: *const c_void,
    instance: c_uint,
    /// Room for a field that some builds have.
    spare: [c_uint; 4],
}

impl Context {
    fn new(coherent: bool) -> Self {
        Self {
            flags: c_int::from(coherent),
            filter: std::ptr::null(),
            instance: u32::MAX,
            spare: [0; 4],
        }
    }
}

impl Ray {
    pub(crate) fn new(origin: Vec3, direction: Vec3, near: f32, far: f32) -> Self {
        Self {
            origin: origin.to_array(),
            near,
            direction: direction.to_array(),
            time: 0.0,
            far,
            mask: u32::MAX,
            id: 0,
            flags: 0,
        }
    }
}

/// A committed scene of one triangle mesh.
#[derive(Debug)]
pub(crate) struct Embree {
    scene: Handle,
    intersect: unsafe extern "C" fn(Handle, *mut Context, *mut RayHit),
    occluded: unsafe extern "C" fn(Handle, *mut Context, *mut Ray),
    occluded8: unsafe extern "C" fn(*const Valid, Handle, *mut Context, *mut Ray8),
    release_scene: unsafe extern "C" fn(Handle),
    release_device: unsafe extern "C" fn(Handle),
    device: Handle,
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: both handles came from this library and are released once.
        unsafe {
            (self.release_scene)(self.scene);
            (self.release_device)(self.device);
        }
    }
}

impl Embree {
    /// Loads `libembree3.so.3` (or the file named) and builds a scene on one thread.
    pub(crate) fn new(
        path: &str,
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        robust: bool,
    ) -> Result<Self, libloading::Error> {
        // SAFETY: Embree's initialisers have no preconditions, and the signatures below are those of rtcore.h 3.13.
        unsafe {
            // Never unloaded: the library keeps threads and thread-local state.
            let library: &'static Library = Box::leak(Box::new(Library::new(path)?));
            let new_device: unsafe extern "C" fn(*const c_char) -> Handle =
                *library.get(b"rtcNewDevice\0")?;
            let new_scene: unsafe extern "C" fn(Handle) -> Handle = *library.get(b"rtcNewScene\0")?;
            let new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle =
                *library.get(b"rtcNewGeometry\0")?;
            let new_buffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void =
                *library.get(b"rtcSetNewGeometryBuffer\0")?;
            let commit_geometry: unsafe extern "C" fn(Handle) = *library.get(b"rtcCommitGeometry\0")?;
            let attach: unsafe extern "C" fn(Handle, Handle) -> c_uint =
                *library.get(b"rtcAttachGeometry\0")?;
            let release_geometry: unsafe extern "C" fn(Handle) = *library.get(b"rtcReleaseGeometry\0")?;
            let set_flags: unsafe extern "C" fn(Handle, c_int) = *library.get(b"rtcSetSceneFlags\0")?;
            let set_quality: unsafe extern "C" fn(Handle, c_int) =
                *library.get(b"rtcSetSceneBuildQuality\0")?;
            let commit_scene: unsafe extern "C" fn(Handle) = *library.get(b"rtcCommitScene\0")?;

            let device = new_device(c"threads=1".as_ptr());
            let scene = new_scene(device);
            set_flags(scene, if robust { 4 } else { 0 });
            set_quality(scene, 1);
            let geometry = new_geometry(device, 0);
            // Types: index 0, vertex 1; formats: 0x5003 three unsigned, 0x9003 three floats.
            let to = new_buffer(geometry, 0, 0, 0x5003, 12, triangles.len());
            std::ptr::copy_nonoverlapping(triangles.as_ptr().cast::<u8>(), to.cast(), size_of_val(triangles));
            let to = new_buffer(geometry, 1, 0, 0x9003, 12, vertices.len());
            std::ptr::copy_nonoverlapping(vertices.as_ptr().cast::<u8>(), to.cast(), size_of_val(vertices));
            commit_geometry(geometry);
            attach(scene, geometry);
            release_geometry(geometry);
            commit_scene(scene);
            Ok(Self {
                scene,
                intersect: *library.get(b"rtcIntersect1\0")?,
                occluded: *library.get(b"rtcOccluded1\0")?,
                occluded8: *library.get(b"rtcOccluded8\0")?,
                release_scene: *library.get(b"rtcReleaseScene\0")?,
                release_device: *library.get(b"rtcReleaseDevice\0")?,
                device,
            })
        }
    }

    /// Distance of the first hit.
    pub(crate) fn closest(&self, ray: Ray) -> Option<f32> {
        let mut hit = RayHit {
            ray,
            normal: [0.0; 3],
            uv: [0.0; 2],
            primitive: u32::MAX,
            geometry: u32::MAX,
            instance: u32::MAX,
        };
        // SAFETY: the scene is committed and alive; the structures are laid out as the library expects.
        unsafe { (self.intersect)(self.scene, &mut Context::new(false), &mut hit) };
        (hit.geometry != u32::MAX).then_some(hit.ray.far)
    }

    pub(crate) fn occluded(&self, mut ray: Ray) -> bool {
        // SAFETY: as in `closest`.
        unsafe { (self.occluded)(self.scene, &mut Context::new(false), &mut ray) };
        ray.far < 0.0
    }

    /// Eight rays as one packet.
    pub(crate) fn occluded8(&self, rays: &[Ray; 8], coherent: bool) -> [bool; 8] {
        let pick = |f: &dyn Fn(&Ray) -> f32| -> [f32; 8] { std::array::from_fn(|i| f(&rays[i])) };
        let mut packet = Ray8 {
            origin: [0, 1, 2].map(|axis| pick(&|ray| ray.origin[axis])),
            near: pick(&|ray| ray.near),
            direction: [0, 1, 2].map(|axis| pick(&|ray| ray.direction[axis])),
            time: [0.0; 8],
            far: pick(&|ray| ray.far),
            mask: [u32::MAX; 8],
            id: [0; 8],
            flags: [0; 8],
        };
        // SAFETY: as in `closest`.
        unsafe {
            (self.occluded8)(
                &Valid([-1; 8]),
                self.scene,
                &mut Context::new(coherent),
                &mut packet,
            )
        };
        packet.far.map(|far| far < 0.0)
    }
}

/// CPU seconds that this thread has used.
pub(crate) fn cpu_seconds() -> f64 {
    #[repr(C)]
    struct Time {
        seconds: i64,
        nanoseconds: i64,
    }
    unsafe extern "C" {
        fn clock_gettime(clock: c_int, time: *mut Time) -> c_int;
    }
    let mut time = Time {
        seconds: 0,
        nanoseconds: 0,
    };
    // SAFETY: the structure is that of 64-bit Linux; clock 3 is CLOCK_THREAD_CPUTIME_ID.
    unsafe { clock_gettime(3, &mut time) };
    time.seconds as f64 + time.nanoseconds as f64 * 1e-9
}
