//! Small integers that name parts of a scene.

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The id as a position in the scene's list.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl From<usize> for $name {
            /// # Panics
            /// If `index` does not fit 32 bits.
            fn from(index: usize) -> Self {
                Self(u32::try_from(index).expect("a scene list has fewer than 2^32 entries"))
            }
        }
    };
}

id!(
    /// Position of a mesh in [`Scene::meshes`](crate::Scene::meshes).
    MeshId
);
id!(
    /// Position of an object in [`Scene::objects`](crate::Scene::objects).
    ObjectId
);
id!(
    /// Position of a light in [`Scene::lights`](crate::Scene::lights).
    LightId
);
id!(
    /// Position of a material in [`Scene::materials`](crate::Scene::materials).
    MaterialId
);
id!(
    /// Position of a texture in [`Scene::textures`](crate::Scene::textures).
    TextureId
);

/// A light whose shadow, cast by one object, falls on another (Bala et al. 2003, section 6.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Triple {
    /// The light.
    pub light: LightId,
    /// The object that blocks it.
    pub blocker: ObjectId,
    /// The object that receives the shadow; it may be the blocker itself.
    pub receiver: ObjectId,
}
