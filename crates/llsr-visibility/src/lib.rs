//! Visibility along a light, as one-dimensional search algorithms see it.
//!
//! A light is the unit interval: `t = 0` is one end, `t = 1` the other. An [oracle](Visibility) answers
//! whether the point at `t` is visible from the point being shaded; nothing here knows what a ray, a light
//! or an occluder is. Searches return a [`Bracket`] around each change of visibility, and the visible set as
//! a [`Partition`] into [`Panel`]s.
//!
//! The oracle is *pulled* one answer at a time, because the searches decide what to ask next from the last
//! answer. Where a search knows several questions at once it calls [`Visibility::visible_each`], which a ray
//! tracer can answer with one packet of rays; the default asks one by one, so a closure is enough:
//!
//! ```
//! use llsr_visibility::{Counting, Visibility};
//!
//! let mut oracle = Counting::new(|t: f64| t < 0.3);
//! assert!(oracle.visible(0.2));
//! assert!(!oracle.visible(0.4));
//! assert_eq!(oracle.tests(), 2);
//! ```

mod bracket;
mod oracle;
mod partition;

pub use bracket::Bracket;
pub use oracle::{ByRef, Counting, Visibility};
pub use partition::{Certificate, Change, Panel, Partition};
