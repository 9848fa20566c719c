//! Scene files through the public interface: what is read, what is repaired, what is refused.

mod cameras;
mod damage;
mod gltf;
mod lights;
mod materials;
mod obj;
mod polygons;
mod round_trip;
mod support;
