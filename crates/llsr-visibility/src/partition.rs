//! The visible set of a light as sorted panels.

/// How far a [`Partition`] can be trusted.
///
/// Ordered from the strongest to the weakest promise, so that the certificate of a union is the maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub enum Certificate {
    /// Every panel end is exact up to rounding and no gap or panel is missing.
    #[default]
    Exact,
    /// Ends are exact, and no gap or panel wider than the stated light-parameter width is missing.
    BoundedGaps(f64),
    /// Found by sampling: each end is as good as its uncertainty says, narrow gaps or panels may be missing.
    Sampled,
}

impl Certificate {
    /// The number written to the `certificate` layer: 0 exact, 1 ends exact and gaps bounded, 2 sampled.
    pub fn level(self) -> u8 {
        match self {
            Self::Exact => 0,
            Self::BoundedGaps(_) => 1,
            Self::Sampled => 2,
        }
    }

    /// The weaker of two promises. A gap bound that is not a number promises nothing: it is `Sampled`.
    pub fn weaker(self, other: Self) -> Self {
        let promises_nothing = |c: &Self| matches!(c, Self::BoundedGaps(width) if width.is_nan());
        if promises_nothing(&self) || promises_nothing(&other) {
            Self::Sampled
        } else if other > self {
            other
        } else {
            self
        }
    }
}

/// A visible stretch of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Panel {
    /// First visible parameter.
    pub start: f64,
    /// Last visible parameter, not below `start`.
    pub end: f64,
    /// Half the width of the bracket in which the start is known to lie, in light parameters; 0 if exact.
    pub start_uncertainty: f64,
    /// The same for the end.
    pub end_uncertainty: f64,
}

impl Panel {
    /// A panel whose ends are exact.
    pub fn exact(start: f64, end: f64) -> Self {
        Self {
            start,
            end,
            start_uncertainty: 0.0,
            end_uncertainty: 0.0,
        }
    }

    /// Width in light parameters.
    pub fn len(&self) -> f64 {
        self.end - self.start
    }

    /// True if the panel has no width.
    pub fn is_empty(&self) -> bool {
        self.end <= self.start
    }
}

/// A place where the light turns from visible to hidden or back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// The place, a light parameter.
    pub t: f64,
    /// Half the width of the bracket in which the change is known to lie, in light parameters; 0 if exact.
    pub uncertainty: f64,
    /// Whether the light is visible just above `t`; just below, it is the opposite.
    pub visible_above: bool,
}

/// The visible part of a light: panels of [0, 1], sorted, disjoint and of positive width.
///
/// Meant to be kept and refilled: [`clear`](Self::clear) keeps the memory, so that a caller that shades
/// millions of points allocates a few times in all.
///
/// ```
/// use llsr_visibility::{Panel, Partition};
///
/// let mut blocked = Partition::dark();
/// blocked.insert(Panel::exact(0.25, 0.5));
/// blocked.insert(Panel::exact(0.4, 0.6));
/// let mut visible = Partition::dark();
/// blocked.complement_into(&mut visible);
/// assert_eq!(visible.panels().len(), 2);
/// assert!((visible.measure() - 0.65).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Partition {
    panels: Vec<Panel>,
    certificate: Certificate,
}

impl Partition {
    /// Nothing is visible.
    pub fn dark() -> Self {
        Self::default()
    }

    /// All of [0, 1] is visible.
    pub fn lit() -> Self {
        Self {
            panels: vec![Panel::exact(0.0, 1.0)],
            certificate: Certificate::Exact,
        }
    }

    /// Makes nothing visible, exactly, and keeps the memory.
    pub fn clear(&mut self) {
        self.panels.clear();
        self.certificate = Certificate::Exact;
    }

    /// Makes all of [0, 1] visible, exactly, and keeps the memory.
    pub fn fill(&mut self) {
        self.clear();
        self.panels.push(Panel::exact(0.0, 1.0));
    }

    /// The visible panels from `t = 0` upwards.
    pub fn panels(&self) -> &[Panel] {
        &self.panels
    }

    /// How far the partition can be trusted.
    pub fn certificate(&self) -> Certificate {
        self.certificate
    }

    /// States how far the partition can be trusted.
    pub fn set_certificate(&mut self, certificate: Certificate) {
        self.certificate = certificate;
    }

    /// Appends a panel that starts at or after the end of the last; cheaper than [`insert`](Self::insert).
    ///
    /// The panel is cut to [0, 1]; an empty one is left out, and one that touches the last is joined to it.
    ///
    /// # Panics
    /// In debug builds, if the panel starts before the end of the last.
    pub fn push(&mut self, panel: Panel) {
        let Some(panel) = clipped(panel) else { return };
        if let Some(last) = self.panels.last_mut() {
            debug_assert!(panel.start >= last.end, "panels must be pushed in order");
            if panel.start <= last.end {
                if panel.end > last.end {
                    (last.end, last.end_uncertainty) = (panel.end, panel.end_uncertainty);
                }
                return;
            }
        }
        self.panels.push(panel);
    }

    /// Adds a panel anywhere: parts outside [0, 1] are cut off, overlapping and touching panels are joined.
    ///
    /// Panels with a NaN or reversed end are left out. Where two ends coincide the smaller uncertainty stays.
    /// Cost: linear in the number of panels.
    pub fn insert(&mut self, panel: Panel) {
        let Some(mut panel) = clipped(panel) else { return };
        let first = self.panels.partition_point(|p| p.end < panel.start);
        let last = self.panels.partition_point(|p| p.start <= panel.end);
        for old in &self.panels[first..last] {
            if old.start < panel.start
                || (old.start == panel.start && old.start_uncertainty < panel.start_uncertainty)
            {
                (panel.start, panel.start_uncertainty) = (old.start, old.start_uncertainty);
            }
            if old.end > panel.end || (old.end == panel.end && old.end_uncertainty < panel.end_uncertainty) {
                (panel.end, panel.end_uncertainty) = (old.end, old.end_uncertainty);
            }
        }
        self.panels.splice(first..last, [panel]);
    }

    /// Adds every panel of `other`; the weaker certificate stays.
    pub fn merge(&mut self, other: &Self) {
        for &panel in &other.panels {
            self.insert(panel);
        }
        self.certificate = self.certificate.weaker(other.certificate);
    }

    /// Writes the rest of [0, 1] to `rest`, with this partition's certificate.
    ///
    /// Points shared by a panel and its complement have no width and do not matter to an integral.
    pub fn complement_into(&self, rest: &mut Self) {
        rest.clear();
        rest.certificate = self.certificate;
        let (mut from, mut uncertainty) = (0.0, 0.0);
        for panel in &self.panels {
            rest.push(Panel {
                start: from,
                end: panel.start,
                start_uncertainty: uncertainty,
                end_uncertainty: panel.start_uncertainty,
            });
            (from, uncertainty) = (panel.end, panel.end_uncertainty);
        }
        rest.push(Panel {
            start: from,
            end: 1.0,
            start_uncertainty: uncertainty,
            end_uncertainty: 0.0,
        });
    }

    /// Total visible width, in [0, 1].
    pub fn measure(&self) -> f64 {
        // The widths are rounded one by one; their sum must not pass 1.
        self.panels.iter().map(Panel::len).sum::<f64>().min(1.0)
    }

    /// True if nothing is visible.
    pub fn is_dark(&self) -> bool {
        self.panels.is_empty()
    }

    /// True if all of [0, 1] is visible.
    pub fn is_lit(&self) -> bool {
        matches!(self.panels.as_slice(), [p] if p.start <= 0.0 && p.end >= 1.0)
    }

    /// Is the point at `t` in a panel? Cost: logarithmic in the number of panels.
    pub fn contains(&self, t: f64) -> bool {
        let after = self.panels.partition_point(|p| p.start <= t);
        after > 0 && t <= self.panels[after - 1].end
    }

    /// The number of changes of visibility strictly inside (0, 1).
    pub fn discontinuities(&self) -> usize {
        self.changes().count()
    }

    /// The changes of visibility strictly inside (0, 1), from `t = 0` upwards.
    pub fn changes(&self) -> impl Iterator<Item = Change> {
        let ends = self.panels.iter().flat_map(|p| {
            [
                Change {
                    t: p.start,
                    uncertainty: p.start_uncertainty,
                    visible_above: true,
                },
                Change {
                    t: p.end,
                    uncertainty: p.end_uncertainty,
                    visible_above: false,
                },
            ]
        });
        ends.filter(|change| 0.0 < change.t && change.t < 1.0)
    }
}

/// The part of `panel` in [0, 1]; ends cut there are exact.
fn clipped(mut panel: Panel) -> Option<Panel> {
    if panel.start < 0.0 {
        (panel.start, panel.start_uncertainty) = (0.0, 0.0);
    }
    if panel.end > 1.0 {
        (panel.end, panel.end_uncertainty) = (1.0, 0.0);
    }
    (panel.start < panel.end).then_some(panel)
}
