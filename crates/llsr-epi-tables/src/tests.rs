//! Brute force against every entry. Nothing here calls the generator's geometry.

use super::*;

/// The point of a boundary segment at `fraction` of its length, in pixels.
fn boundary_point(segment: usize, per_side: usize, fraction: f64) -> (f64, f64) {
    let along = ((segment % per_side) as f64 + fraction) / per_side as f64;
    match segment / per_side {
        0 => (along, 0.0),
        1 => (1.0, along),
        2 => (along, 1.0),
        _ => (0.0, along),
    }
}

fn turn(a: (f64, f64), b: (f64, f64), p: (f64, f64)) -> f64 {
    (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0)
}

/// Sides by trying edges and points: 5 crossings in each segment, 5 x 5 points in each region.
fn tried_sides(per_side: usize, regions: usize, first: usize, second: usize) -> Vec<u32> {
    let tries = [0.0, 0.25, 0.5, 0.75, 1.0];
    let mut seen = vec![(false, false); regions * regions];
    for f in tries {
        for s in tries {
            let (a, b) = (
                boundary_point(first, per_side, f),
                boundary_point(second, per_side, s),
            );
            for (region, seen) in seen.iter_mut().enumerate() {
                for u in tries {
                    for v in tries {
                        let x = ((region % regions) as f64 + u) / regions as f64;
                        let y = ((region / regions) as f64 + v) / regions as f64;
                        let side = turn(a, b, (x, y));
                        seen.0 |= side > 1e-9;
                        seen.1 |= side < -1e-9;
                    }
                }
            }
        }
    }
    seen.into_iter()
        .map(|s| match s {
            (true, false) => 1,
            (false, true) => 2,
            _ => 0,
        })
        .collect()
}

#[test]
fn sides_hold_for_every_edge_with_the_code() {
    let tables = Tables::generate();
    for first in 0..32 {
        for second in 0..32 {
            let packed = tables.side[code(first, second)];
            if first / 8 == second / 8 {
                assert_eq!(packed, 0, "code {first}-{second} is no edge");
                continue;
            }
            for (region, side) in tried_sides(8, 4, first, second).into_iter().enumerate() {
                assert_eq!(
                    packed >> (2 * region) & 3,
                    side,
                    "edge {first}-{second}, region {region}"
                );
            }
        }
    }
    for first in 0..16 {
        for second in (0..16).filter(|second| second / 4 != first / 4) {
            let packed = u32::from(tables.half_side[first * 16 + second]);
            for (region, side) in tried_sides(4, 2, first, second).into_iter().enumerate() {
                assert_eq!(
                    packed >> (2 * region) & 3,
                    side,
                    "half edge {first}-{second}, region {region}"
                );
            }
        }
    }
}

#[test]
fn areas_match_counting_and_complement_each_other() {
    let tables = Tables::generate();
    let check = |area: &dyn Fn(usize, usize) -> u16, per_side: usize| {
        for first in 0..4 * per_side {
            for second in (0..4 * per_side).filter(|s| s / per_side != first / per_side) {
                let (a, b) = (
                    boundary_point(first, per_side, 0.5),
                    boundary_point(second, per_side, 0.5),
                );
                let inside = (0..64 * 64)
                    .filter(|i| {
                        turn(
                            a,
                            b,
                            ((f64::from(i % 64) + 0.5) / 64.0, (f64::from(i / 64) + 0.5) / 64.0),
                        ) > 0.0
                    })
                    .count();
                let counted = inside as f64 / 8.0;
                let stored = f64::from(area(first, second));
                assert!(
                    (stored - counted).abs() < 8.0,
                    "edge {first}-{second}: {stored} is not {counted}"
                );
                assert_eq!(
                    area(first, second) + area(second, first),
                    512,
                    "the two regions fill the pixel"
                );
            }
        }
    };
    check(&|f, s| tables.area[code(f, s)], 8);
    check(&|f, s| tables.half_area[f * 16 + s], 4);
}

#[test]
fn fourteen_corner_patterns_occur() {
    let tables = Tables::generate();
    let mut seen = [0; 16];
    for c in (0..1024).filter(|&c| c == EMPTY || c == COMPLEX || c / 32 / 8 != c % 32 / 8) {
        seen[usize::from(tables.corners[c])] += 1;
    }
    for (pattern, &count) in seen.iter().enumerate() {
        let expected = match pattern {
            0b0000 | 0b1111 => 1,
            0b0101 | 0b1010 => 0,
            _ => 64,
        };
        assert_eq!(count, expected, "codes with the corner pattern {pattern:04b}");
    }
}

#[test]
fn swapped_ends_swap_the_regions() {
    let tables = Tables::generate();
    for first in 0..32 {
        for second in (0..32).filter(|s| s / 8 != first / 8) {
            let (there, back) = (code(first, second), code(second, first));
            assert_eq!(
                tables.corners[there] ^ tables.corners[back],
                0b1111,
                "corners of {first}-{second}"
            );
            let swapped = (tables.side[there] & 0x5555_5555) << 1 | (tables.side[there] & 0xaaaa_aaaa) >> 1;
            assert_eq!(swapped, tables.side[back], "sides of {first}-{second}");
        }
    }
}

/// Two regions of neighbours meet if they are seen at the same point of the boundary. The flood fill is in llsr-epi.
#[test]
fn neighbours_match_the_regions_seen_along_the_boundary() {
    let tables = Tables::generate();
    let regions = |c: usize, side: usize| -> Option<Vec<u8>> {
        // The region (0 primary, 1 secondary) at 16 points along one side of the pixel.
        match c {
            EMPTY => Some(vec![0; 16]),
            COMPLEX => None,
            _ => {
                let (a, b) = (boundary_point(c / 32, 8, 0.5), boundary_point(c % 32, 8, 0.5));
                let along = |i: usize| (i as f64 + 0.5) / 16.0;
                let point = |i| match side {
                    0 => (along(i), 0.0),
                    1 => (1.0, along(i)),
                    2 => (along(i), 1.0),
                    _ => (0.0, along(i)),
                };
                Some((0..16).map(|i| u8::from(turn(a, b, point(i)) < 0.0)).collect())
            }
        }
    };
    let crossing = |c: usize, side: usize| {
        [c / 32, c % 32]
            .into_iter()
            .find(|s| c > 1 && s / 8 == side)
            .map(|s| s % 8)
    };
    let codes: Vec<usize> = (0..1024).filter(|&c| c < 2 || c / 32 / 8 != c % 32 / 8).collect();
    let mut checked = 0;
    for &a in &codes {
        for &b in &codes {
            for (table, side_a, side_b) in [(&tables.neighbour_right, 1, 3), (&tables.neighbour_down, 2, 0)] {
                if crossing(a, side_a) != crossing(b, side_b) && a != COMPLEX && b != COMPLEX {
                    continue;
                }
                let expected = match (regions(a, side_a), regions(b, side_b)) {
                    (Some(a), Some(b)) => a.iter().zip(&b).fold(0, |mask, (a, b)| mask | 1u8 << (2 * a + b)),
                    _ => 0,
                };
                let index = usize::from(tables.corners[a]) * 16 + usize::from(tables.corners[b]);
                assert_eq!(
                    table[index], expected,
                    "codes {a:#x} and {b:#x} over side {side_a}"
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 300_000, "consistent pairs: {checked}");
}

#[test]
fn chaining_is_the_product_of_relations() {
    let tables = Tables::generate();
    for ab in 0..16usize {
        for bc in 0..16usize {
            let relation = |mask: usize, from: usize, to: usize| mask & 1 << (2 * from + to) != 0;
            for (from, to) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let expected = relation(ab, from, 0) && relation(bc, 0, to)
                    || relation(ab, from, 1) && relation(bc, 1, to);
                let found = relation(usize::from(tables.chain[ab * 16 + bc]), from, to);
                assert_eq!(found, expected, "{ab:04b} then {bc:04b}, {from} to {to}");
            }
        }
    }
    // The example of BWG03 section 5.2.
    let product = |x: u8, y: u8| tables.chain[usize::from(x) * 16 + usize::from(y)];
    assert_eq!(product(PP, PS), PS, "through b");
    assert_eq!(product(PS, PP | SS), PS, "through c");
}

#[test]
fn lenders_touch_the_secondary_region_and_whole_sides_lead() {
    let tables = Tables::generate();
    let offsets = [
        (0, -1),
        (1, -1),
        (1, 0),
        (1, 1),
        (0, 1),
        (-1, 1),
        (-1, 0),
        (-1, -1),
    ];
    for first in 0..32 {
        for second in (0..32).filter(|s| s / 8 != first / 8) {
            let (a, b) = (boundary_point(first, 8, 0.5), boundary_point(second, 8, 0.5));
            for i in 0..5 {
                let (dx, dy) = offsets[usize::from(tables.lenders[code(first, second)] >> (3 * i) & 7)];
                // Some point of the boundary shared with that neighbour is secondary.
                let touches = (0..=32).any(|k| {
                    let t = f64::from(k) / 32.0;
                    let x = if dx == 0 { t } else { f64::from(dx.max(0)) };
                    let y = if dy == 0 { t } else { f64::from(dy.max(0)) };
                    turn(a, b, (x, y)) < 0.0
                });
                assert!(
                    touches,
                    "edge {first}-{second}: lender {i} at {dx},{dy} touches only the primary region"
                );
            }
        }
    }
    // A vertical edge with the primary region to its left borrows from the right.
    assert_eq!(
        tables.area[code(4, 20)],
        288,
        "clockwise of a downward edge is the left"
    );
    assert_eq!(tables.lenders[code(4, 20)] & 7, 2, "the neighbour to the right");
    assert_eq!(tables.lenders[code(20, 4)] & 7, 6, "the neighbour to the left");
}

#[test]
fn source_holds_every_value() {
    let tables = Tables::generate();
    let source = tables.to_source();
    let numbers = source
        .lines()
        .filter(|l| !l.contains("static") && !l.starts_with("//"));
    let count: usize = numbers.map(|l| l.matches(',').count()).sum();
    assert_eq!(
        count,
        4 * 1024 + 3 * 256 + 2 * 256,
        "values in the generated source"
    );
    assert!(tables.byte_len() < 16 * 1024, "{} bytes", tables.byte_len());
}
