//! Glossy reflection against dense sampling of the BRDF.

use glam::DVec3;
use llsr_quadrature::{
    Emission, Glossy, GlossyOptions, LineGlossy, LineIrradiance, LineLight, MetalRough, Receiver,
};
use llsr_testkit::quadrature::{Law, metal_rough, reflected};
use llsr_visibility::{Panel, Partition};
use proptest::prelude::*;
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

const LAWS: [(Emission, Law); 2] = [
    (Emission::Diffuse, Law::Diffuse),
    (Emission::Isotropic, Law::Isotropic),
];

fn material(metallic: f64, roughness: f64) -> MetalRough {
    MetalRough {
        base_color: DVec3::new(0.9, 0.5, 0.2),
        metallic,
        roughness,
    }
}

fn dense(
    receiver: &Receiver,
    light: &LineLight,
    view: DVec3,
    m: &MetalRough,
    range: (f64, f64),
    pieces: u32,
) -> DVec3 {
    let law = LAWS[usize::from(light.emission == Emission::Isotropic)].1;
    let channel = |base: f64| {
        let brdf = |l| metal_rough(base, m.metallic, m.roughness, receiver.normal, view, l);
        light.flux
            * reflected(
                receiver.position,
                receiver.normal,
                (light.a, light.b),
                law,
                range,
                pieces,
                brdf,
            )
    };
    DVec3::from_array(m.base_color.to_array().map(channel))
}

fn direction() -> impl Strategy<Value = DVec3> {
    // Over the receiver's horizon, down to grazing.
    (0.02..1.0f64, 0.0..std::f64::consts::TAU).prop_map(|(z, phi)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), z, r * phi.sin())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_material_matches_dense_sampling(
        view in direction(), x in -2.0..2.0f64, y in 0.1..3.0f64, z in -2.0..2.0f64, to in direction(),
        roughness in 0.1..1.0f64, metallic in 0.0..1.0f64, t0 in 0.0..0.7f64, width in 0.01..1.0f64,
    ) {
        let (a, t1) = (DVec3::new(x, y, z), (t0 + width).min(1.0));
        let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
        for (emission, _) in LAWS {
            let light = LineLight { a, b: a + 2.0 * to, emission, flux: 100.0 };
            let m = material(metallic, roughness);
            let options = GlossyOptions { tolerance: 1e-6, max_evaluations: 448 };
            let found = LineGlossy::new(&receiver, &light, view, roughness).panel(t0, t1, &options);
            let radiance = m.radiance(&found.lobes);
            let truth = dense(&receiver, &light, view, &m, (t0, t1), 60);
            prop_assert!((radiance - truth).abs().cmple(2e-5 * truth).all(), "{} against {}, {:?}", radiance, truth, found);
        }
    }

    #[test]
    fn anything_gives_a_finite_answer(v in prop::array::uniform12(prop_oneof![
        -1.0..1.0f64, Just(0.0), Just(1.0), Just(f64::NAN), Just(1e-30), Just(-1.0), Just(1e30),
    ]), view in direction(), roughness in prop_oneof![0.0..1.0f64, Just(0.0), Just(f64::NAN), Just(-3.0), Just(9.0)]) {
        let normal = DVec3::from_slice(&v[3..6]).normalize_or(DVec3::Y);
        let receiver = Receiver { position: DVec3::from_slice(&v[0..3]), normal };
        for (emission, _) in LAWS {
            let light = LineLight { a: DVec3::from_slice(&v[6..9]), b: DVec3::from_slice(&v[9..12]), emission, flux: 1.0 };
            let glossy = LineGlossy::new(&receiver, &light, view, roughness);
            let lobes = glossy.panel(0.0, 1.0, &GlossyOptions::default()).lobes;
            for value in [lobes.f0, lobes.grazing, lobes.diffuse] {
                prop_assert!(value.is_finite() && value >= 0.0, "{:?} for {:?} {:?} {}", lobes, receiver, light, roughness);
            }
        }
    }
}

/// The light passes through (or near) the mirror direction of the viewer, at any sharpness. Fixed seeds, since
/// an error estimate is wrong now and then: at most in one case of 500, and by a factor of 10.
#[test]
fn sharp_lobes_are_not_missed() {
    const CASES: u32 = 1500;
    let receiver = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let options = GlossyOptions {
        tolerance: 1e-4,
        max_evaluations: 448,
    };
    let mut over = 0;
    for case in 0..CASES {
        let mut random = Pcg64Mcg::new(u128::from(case));
        let mut within = |lo: f64, hi: f64| {
            let unit = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            lo + (hi - lo) * unit
        };
        let mut direction = || {
            let (z, phi) = (within(0.02, 1.0), within(0.0, std::f64::consts::TAU));
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * phi.cos(), z, r * phi.sin())
        };
        let (view, along) = (direction(), direction());
        let (distance, t, roughness) = (within(0.3, 3.0), within(0.05, 0.95), within(0.02, 0.3));
        let mirror = DVec3::new(-view.x, view.y, -view.z);
        // Off the mirror direction by some widths of the lobe.
        let off = within(-3.0, 3.0) * roughness * roughness * mirror.any_orthonormal_vector();
        let point = distance * (mirror + off);
        let (a, b) = (point - t * along, point + (1.0 - t) * along);
        let light = LineLight {
            a,
            b,
            emission: Emission::Diffuse,
            flux: 1.0,
        };
        let m = material(1.0, roughness);
        let found = LineGlossy::new(&receiver, &light, view, roughness).panel(0.0, 1.0, &options);
        let truth = dense(&receiver, &light, view, &m, (0.0, 1.0), 800);
        let error = (m.radiance(&found.lobes) - truth).abs() / truth.max(DVec3::splat(f64::MIN_POSITIVE));
        assert!(
            error.max_element() < 1e-3,
            "case {case}: {error} of {truth}, {found:?}"
        );
        over += u32::from(error.max_element() > 1e-4);
    }
    assert!(over * 500 <= CASES, "{over} of {CASES} outside the tolerance");
}

fn overhead() -> (Receiver, LineLight, DVec3) {
    let light = LineLight {
        a: DVec3::new(-1.0, 1.0, 1.0),
        b: DVec3::new(1.0, 1.5, 1.0),
        emission: Emission::Diffuse,
        flux: 100.0,
    };
    (
        Receiver {
            position: DVec3::ZERO,
            normal: DVec3::Y,
        },
        light,
        DVec3::new(0.1, 1.0, -1.0).normalize(),
    )
}

#[test]
fn partitions_are_sums_of_panels_and_faint_panels_are_cheap() {
    let (receiver, light, view) = overhead();
    let glossy = LineGlossy::new(&receiver, &light, view, 0.2);
    let options = GlossyOptions::default();
    let mut partition = Partition::dark();
    let panels = [(0.0, 0.05), (0.3, 0.5), (0.7, 1.0)];
    panels
        .iter()
        .for_each(|&(t0, t1)| partition.insert(Panel::exact(t0, t1)));
    let all = glossy.partition(&partition, &options);
    let sum = panels.iter().fold(Glossy::default(), |mut sum, &(t0, t1)| {
        let one = glossy.panel(t0, t1, &options);
        sum.lobes += one.lobes;
        sum.evaluations += one.evaluations;
        sum
    });
    assert!(
        (all.lobes.f0 / sum.lobes.f0 - 1.0).abs() < 2e-3,
        "{all:?} against {sum:?}"
    );
    assert!(all.evaluations <= sum.evaluations, "{all:?} against {sum:?}");
}

#[test]
fn the_bound_on_evaluations_holds_and_the_error_says_so() {
    let (receiver, light, view) = overhead();
    let glossy = LineGlossy::new(&receiver, &light, view, 0.3);
    let strict = |max_evaluations| {
        glossy.panel(
            0.0,
            1.0,
            &GlossyOptions {
                tolerance: 1e-13,
                max_evaluations,
            },
        )
    };
    for bound in [28, 42, 70, 448] {
        let found = strict(bound);
        assert!(found.evaluations <= bound, "{found:?} within {bound}");
    }
    let (rough, fine) = (strict(28), strict(448));
    assert!(
        rough.error > 1e-13 * rough.lobes.f0 && fine.error < 0.01 * rough.error,
        "{rough:?}, {fine:?}"
    );
}

#[test]
fn a_rough_white_metal_under_a_far_light_reflects_like_the_brdf_at_a_point() {
    let receiver = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let view = DVec3::new(0.3, 0.8, 0.1).normalize();
    let toward = DVec3::new(-0.5, 0.7, 0.2).normalize();
    let m = material(0.4, 0.6);
    for length in [0.0, 1e-3] {
        let (a, b) = (1e4 * toward, 1e4 * toward + length * DVec3::X);
        let light = LineLight {
            a,
            b,
            emission: Emission::Isotropic,
            flux: 1e9,
        };
        let lobes = LineGlossy::new(&receiver, &light, view, m.roughness)
            .panel(0.0, 1.0, &GlossyOptions::default())
            .lobes;
        let irradiance = LineIrradiance::new(&receiver, &light).panel(0.0, 1.0);
        let radiance = m.radiance(&lobes);
        for (channel, base) in m.base_color.to_array().into_iter().enumerate() {
            let expected = irradiance * metal_rough(base, 0.4, 0.6, DVec3::Y, view, toward);
            assert!(
                (radiance[channel] / expected - 1.0).abs() < 1e-6,
                "channel {channel}: {radiance}, {expected}"
            );
        }
    }
}

#[test]
fn the_horizon_is_clipped() {
    let receiver = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let view = DVec3::new(0.6, 0.8, 0.0);
    let light = LineLight {
        a: DVec3::new(-1.0, -1.0, 0.0),
        b: DVec3::new(-1.0, 1.0, 0.2),
        emission: Emission::Diffuse,
        flux: 1.0,
    };
    let glossy = LineGlossy::new(&receiver, &light, view, 0.5);
    let options = GlossyOptions {
        tolerance: 1e-9,
        max_evaluations: 448,
    };
    let (all, upper) = (glossy.panel(0.0, 1.0, &options), glossy.panel(0.5, 1.0, &options));
    assert!(
        (all.lobes.f0 / upper.lobes.f0 - 1.0).abs() < 1e-9,
        "{all:?} against {upper:?}"
    );
    assert_eq!(
        glossy.panel(0.0, 0.5, &options),
        Glossy::default(),
        "below the horizon"
    );
    let below = LineGlossy::new(
        &Receiver {
            normal: -DVec3::X,
            ..receiver
        },
        &light,
        -view,
        0.5,
    );
    assert!(
        below.panel(0.0, 1.0, &options).lobes.f0 >= 0.0,
        "a wall behind is another receiver"
    );
}
