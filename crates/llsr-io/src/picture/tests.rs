//! Pictures written, read back, damaged.

use glam::Vec3;

use super::*;

fn directory() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

#[test]
fn exr_keeps_every_bit_of_every_layer() {
    let mut image = Image::new(3, 2);
    let odd = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE / 8.0, 1e30];
    for name in ["R", "G", "B", "irradiance:tube.001.Y", "albedo.R", "depth.Z"] {
        image.push(name, odd.to_vec());
    }
    let directory = directory();
    let path = directory.path().join("a.exr");
    write_exr(&path, &image).expect("a picture");
    let back = read_image(&path).expect("the same picture");
    assert_eq!((back.width, back.height), (3, 2), "size");
    let names: Vec<&str> = back.channels.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        ["B", "G", "R", "albedo.R", "depth.Z", "irradiance:tube.001.Y"],
        "sorted names"
    );
    for (name, values) in &back.channels {
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(values), bits(&odd), "{name}");
    }
}

#[test]
fn exr_bytes_depend_on_the_data_alone() {
    let directory = directory();
    let write = |name: &str| {
        let pixels: Vec<Vec3> = (0..64 * 48).map(|i| Vec3::splat(i as f32).sin()).collect();
        let path = directory.path().join(name);
        write_exr(&path, &Image::from_rgb(64, 48, &pixels)).expect("a picture");
        std::fs::read(path).expect("its bytes")
    };
    let bytes = write("one.exr");
    assert_eq!(
        bytes,
        write("another name.exr"),
        "no time and no name in the file"
    );
    for word in ["Date", "software", "owner", "host", "comments"] {
        let found = bytes
            .windows(word.len())
            .any(|w| w.eq_ignore_ascii_case(word.as_bytes()));
        assert!(!found, "the header says nothing of {word}");
    }
}

#[test]
fn exr_names_that_do_not_fit_are_changed_and_stay_apart() {
    let mut image = Image::new(1, 1);
    let long = "x".repeat(300);
    for (i, name) in [
        "irradiance:Röhre.Y",
        "irradiance:R_hre.Y",
        &long,
        &format!("{long}y"),
    ]
    .into_iter()
    .enumerate()
    {
        image.push(name, vec![i as f32]);
    }
    let directory = directory();
    let path = directory.path().join("a.exr");
    write_exr(&path, &image).expect("a picture");
    let back = read_image(&path).expect("the same picture");
    assert_eq!(
        back.channel("irradiance:R_hre.Y"),
        Some(&[0.0][..]),
        "the first keeps the plain form"
    );
    assert_eq!(
        back.channel("irradiance:R_hre-2.Y"),
        Some(&[1.0][..]),
        "the second gets a number"
    );
    assert_eq!(back.channels.len(), 4, "none is lost");
}

#[test]
fn pictures_that_do_not_fit_are_refused() {
    let directory = directory();
    let path = directory.path().join("a");
    let cause = |image: &Image| write_exr(&path, image).expect_err("refused").to_string();
    assert!(cause(&Image::new(0, 4)).contains("0 x 4"), "no pixels");
    assert!(cause(&Image::new(4, 4)).contains("no channels"), "no channels");
    let image = Image {
        width: 2,
        height: 1,
        channels: vec![("R".to_owned(), vec![1.0])],
    };
    assert!(cause(&image).contains("channel R has 1 values"), "too few values");
    let mut image = Image::new(1, 1);
    image.push("depth.Z", vec![1.0]);
    let png = write_png(&path, &image, Development::default())
        .expect_err("no colour")
        .to_string();
    assert!(png.contains("neither"), "{png}");
    assert!(!path.exists(), "nothing was written");
}

#[test]
fn png_shows_srgb_after_exposure() {
    let directory = directory();
    let path = directory.path().join("a.png");
    let pixels = [
        Vec3::ZERO,
        Vec3::splat(0.25),
        Vec3::new(0.5, 1.0, 7.0),
        Vec3::splat(f32::NAN),
    ];
    let image = Image::from_rgb(4, 1, &pixels);
    write_png(
        &path,
        &image,
        Development {
            exposure: 1.0,
            tone: Tone::Srgb,
        },
    )
    .expect("a picture");
    let back = read_image(&path).expect("a picture").rgb().expect("colours");
    let want = [Vec3::ZERO, Vec3::splat(0.5), Vec3::ONE, Vec3::ZERO];
    for (got, want) in back.iter().zip(want) {
        // One of 255 steps, which near white are 0.9 % of linear light.
        assert!((got - want).abs().max_element() < 0.01, "{got} is nearly {want}");
    }
}

#[test]
fn filmic_keeps_mid_grey_rises_and_ends_at_white() {
    let value = |x: f32| Tone::Filmic.encode(Vec3::splat(x)).x;
    let grey = Tone::Srgb.encode(Vec3::splat(0.18)).x;
    assert!(
        (value(0.18) - grey).abs() < 1e-4,
        "mid grey: {} and {grey}",
        value(0.18)
    );
    let mut last = 0.0;
    for step in 0..400 {
        let x = 1e-4 * 1.05f32.powi(step);
        assert!(value(x) >= last, "rising at {x}");
        last = value(x);
    }
    assert!(value(f32::INFINITY) > 0.9999, "infinitely bright is white");
    assert_eq!(value(-1.0), 0.0, "below black is black");
    assert!(
        value(1.0) < Tone::Srgb.encode(Vec3::ONE).x,
        "white keeps room for highlights"
    );
}

#[test]
fn exposure_brings_any_unit_into_view() {
    let pixels: Vec<Vec3> = (0..1000).map(|i| Vec3::splat(i as f32)).collect();
    let exposure = exposure_for(&pixels);
    assert!(
        (899.0 * exposure.exp2() - 0.8).abs() < 1e-3,
        "the 90th percentile is at 0.8"
    );
    let darker: Vec<Vec3> = pixels.iter().map(|p| p / 1024.0).collect();
    assert!(
        (exposure_for(&darker) - exposure - 10.0).abs() < 1e-6,
        "1024 times darker is ten stops"
    );
    let around = [&pixels[..], &[Vec3::ZERO; 9000]].concat();
    assert_eq!(
        exposure_for(&around),
        exposure,
        "what is black around it does not matter"
    );
    assert_eq!(exposure_for(&[Vec3::ZERO; 9]), 0.0, "black stays black");
    let mut sparse = [Vec3::ZERO; 100];
    sparse[7] = Vec3::splat(0.4);
    assert!(
        (exposure_for(&sparse) - 1.0).abs() < 1e-6,
        "a single lit pixel counts"
    );
    assert_eq!(exposure_for(&[Vec3::NAN, Vec3::INFINITY]), 0.0, "nothing finite");
}

#[test]
fn damaged_pictures_are_errors_and_lies_about_size_cost_no_memory() {
    let directory = directory();
    let path = directory.path().join("a.exr");
    write_exr(&path, &Image::from_rgb(16, 16, &[Vec3::ONE; 256])).expect("a picture");
    let bytes = std::fs::read(&path).expect("its bytes");
    // The data window's right end, as a 32-bit number behind the attribute's name, type and size.
    let name = b"dataWindow\0box2i\0";
    let at = bytes
        .windows(name.len())
        .position(|w| w == name)
        .expect("a data window")
        + name.len()
        + 4
        + 8;
    let mut huge = bytes.clone();
    huge[at..at + 8].copy_from_slice(&[0xff, 0xff, 0x03, 0, 0xff, 0xff, 0x03, 0]);
    std::fs::write(&path, &huge).expect("a damaged picture");
    let error = read_image(&path).expect_err("262144 x 262144 pixels");
    assert!(matches!(error, Error::TooLarge { .. }), "{error}");

    for cut in [0, 3, 8, 100, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..cut]).expect("a cut picture");
        assert!(read_image(&path).is_err(), "cut at {cut}");
    }
    std::fs::write(&path, b"P6 1 1 255 abc").expect("another format");
    let error = read_image(&path).expect_err("not ours").to_string();
    assert!(error.contains("neither PNG nor EXR"), "{error}");
}

#[test]
fn flipped_bits_of_pictures_never_panic() {
    let directory = directory();
    let path = directory.path().join("a");
    let image = Image::from_rgb(8, 8, &[Vec3::new(0.1, 0.5, 0.9); 64]);
    for png in [false, true] {
        if png {
            write_png(&path, &image, Development::default()).expect("a picture");
        } else {
            write_exr(&path, &image).expect("a picture");
        }
        let bytes = std::fs::read(&path).expect("its bytes");
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            if let Ok(image) = decode(&path, &damaged) {
                assert!(image.fault().is_none(), "what is read fits together (bit {bit})");
            }
        }
    }
}
