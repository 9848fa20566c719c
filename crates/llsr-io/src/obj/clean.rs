//! The text of an OBJ file, brought into the part of the language that tobj reads safely.
//!
//! tobj stops at the first bad byte, number or index without saying where, divides by curve weights, fills in texture
//! coordinates that only some corners have, and reads NaN as a number. Here each statement is checked first;
//! what cannot be kept is left out and noted with its line. Vertices come out before faces, and faces sorted by
//! object, material and kind of corner, so that each of tobj's models is uniform.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::{self, BufRead, Read};

use crate::import::FARTHEST;
use crate::warning::{WarningKind, Warnings};

/// Faces that become one model.
#[derive(Debug)]
pub(super) struct Bucket {
    /// Position in [`Cleaned::objects`].
    pub(super) object: usize,
    /// Position in [`Cleaned::materials`].
    pub(super) material: Option<usize>,
    /// Whether corners have texture coordinates and normals.
    pub(super) kind: CornerKind,
    /// Line of each face.
    pub(super) lines: Vec<u32>,
    text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct CornerKind {
    pub(super) uv: bool,
    pub(super) normal: bool,
}

/// The file's statements after checking.
#[derive(Debug, Default)]
pub(super) struct Cleaned {
    vertices: String,
    pub(super) buckets: Vec<Bucket>,
    /// Names of objects with faces.
    pub(super) objects: Vec<String>,
    /// Names of materials in use.
    pub(super) materials: Vec<String>,
    /// Line of the first use of each material.
    pub(super) material_lines: Vec<u32>,
    /// Material libraries as named, with their lines.
    pub(super) libraries: Vec<(String, u32)>,
}

impl Cleaned {
    /// The text for tobj, one object for each bucket, named by its position.
    pub(super) fn reader(&self) -> impl BufRead {
        let separators: Vec<String> = (0..self.buckets.len()).map(|i| format!("o {i}\n")).collect();
        let faces = separators
            .into_iter()
            .zip(&self.buckets)
            .flat_map(|(separator, bucket)| {
                [
                    Cow::Owned(separator.into_bytes()),
                    Cow::Borrowed(bucket.text.as_bytes()),
                ]
            });
        let vertices = std::iter::once(Cow::Borrowed(self.vertices.as_bytes()));
        Pieces {
            rest: vertices.chain(faces),
            current: Cow::Borrowed(&[]),
            read: 0,
        }
    }
}

/// Reads one text after the other.
struct Pieces<'a, I> {
    rest: I,
    current: Cow<'a, [u8]>,
    read: usize,
}

impl<'a, I: Iterator<Item = Cow<'a, [u8]>>> Read for Pieces<'a, I> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl<'a, I: Iterator<Item = Cow<'a, [u8]>>> BufRead for Pieces<'a, I> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.read == self.current.len() {
            let Some(next) = self.rest.next() else {
                return Ok(&[]);
            };
            self.current = next;
            self.read = 0;
        }
        Ok(&self.current[self.read..])
    }

    fn consume(&mut self, amount: usize) {
        self.read += amount;
    }
}

/// Statements of a text: continued lines joined, bad bytes replaced, comment lines and empty lines left out;
/// each with the number of its first line.
pub(super) fn statements<'a>(
    bytes: &'a [u8],
    mut each: impl FnMut(u32, Cow<'a, str>),
    warnings: &mut Warnings,
) {
    let mut joined: Option<(u32, Vec<u8>)> = None;
    let mut finish = |number: u32, line: Cow<'a, [u8]>, warnings: &mut Warnings| {
        let text = match line {
            Cow::Borrowed(bytes) => String::from_utf8_lossy(bytes),
            Cow::Owned(bytes) => Cow::Owned(String::from_utf8_lossy(&bytes).into_owned()),
        };
        if text.contains(char::REPLACEMENT_CHARACTER) {
            warnings.add(WarningKind::BadText, || format!("line {number}"));
        }
        each(number, text);
    };
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // Old files end their lines with a carriage return alone.
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    for (index, line) in bytes.split(|&b| b == end).enumerate() {
        let number = u32::try_from(index + 1).unwrap_or(u32::MAX);
        let line = line.trim_ascii();
        let (line, continued) = match line.strip_suffix(b"\\") {
            Some(line) => (line, true),
            None => (line, false),
        };
        match (&mut joined, continued) {
            (None, false) if line.is_empty() || line[0] == b'#' => {}
            (None, false) => finish(number, Cow::Borrowed(line), warnings),
            (None, true) => joined = Some((number, line.to_vec())),
            (Some((_, text)), true) => {
                text.push(b' ');
                text.extend_from_slice(line);
            }
            (Some((first, text)), false) => {
                text.push(b' ');
                text.extend_from_slice(line);
                let (first, text) = (*first, std::mem::take(text));
                joined = None;
                if text[0] != b'#' {
                    finish(first, Cow::Owned(text), warnings);
                }
            }
        }
    }
    if let Some((first, text)) = joined {
        finish(first, Cow::Owned(text), warnings);
    }
}

/// How many vertices, texture coordinates and normals a file has, and which of them are unusable.
#[derive(Default)]
struct Attributes {
    seen: [usize; 3],
    total: [usize; 3],
    bad: [Vec<usize>; 3],
}

const VERTEX: usize = 0;
const UV: usize = 1;
const NORMAL: usize = 2;

/// Checks the statements of an OBJ file.
pub(super) fn clean(bytes: &[u8], warnings: &mut Warnings) -> Cleaned {
    let mut state = Cleaner::new(bytes);
    // The statements borrow the collector, so theirs is a second one.
    let mut text_warnings = Warnings::default();
    statements(
        bytes,
        |line, text| state.statement(line, &text, warnings),
        &mut text_warnings,
    );
    warnings.merge(text_warnings);
    state.out
}

struct Cleaner {
    out: Cleaned,
    attributes: Attributes,
    object: String,
    group: String,
    objects: HashMap<String, usize>,
    materials: HashMap<String, usize>,
    material: Option<usize>,
    buckets: HashMap<(usize, Option<usize>, CornerKind), usize>,
    /// Object of the current names, once a face needs it.
    current_object: Option<usize>,
    corners: Vec<[Option<usize>; 3]>,
}

impl Cleaner {
    fn new(bytes: &[u8]) -> Self {
        let mut attributes = Attributes::default();
        // Faces may name vertices that come later, so these are counted first, as `statements` will see them.
        let mut ignored = Warnings::default();
        statements(
            bytes,
            |_, text| match text.split_ascii_whitespace().next() {
                Some("v") => attributes.total[VERTEX] += 1,
                Some("vt") => attributes.total[UV] += 1,
                Some("vn") => attributes.total[NORMAL] += 1,
                _ => {}
            },
            &mut ignored,
        );
        Self {
            out: Cleaned::default(),
            attributes,
            object: String::new(),
            group: String::new(),
            objects: HashMap::new(),
            materials: HashMap::new(),
            material: None,
            buckets: HashMap::new(),
            current_object: None,
            corners: Vec::new(),
        }
    }

    fn statement(&mut self, line: u32, text: &str, warnings: &mut Warnings) {
        let (keyword, rest) = text
            .split_once(|c: char| c.is_ascii_whitespace())
            .unwrap_or((text, ""));
        let data = rest.split('#').next().unwrap_or("");
        let ignored = |warnings: &mut Warnings, what: &str| {
            warnings.add(WarningKind::Ignored, || format!("{what} (line {line})"));
        };
        match keyword {
            "v" => self.attribute(VERTEX, line, data, warnings),
            "vt" => self.attribute(UV, line, data, warnings),
            "vn" => self.attribute(NORMAL, line, data, warnings),
            // "fo" is the old name of a face.
            "f" | "fo" => self.face(line, data, warnings),
            "o" => {
                self.object = rest.trim().to_owned();
                self.group.clear();
                self.current_object = None;
            }
            "g" => {
                self.group = rest.trim().to_owned();
                self.current_object = None;
            }
            "usemtl" => {
                let name = rest.trim();
                if name.is_empty() {
                    warnings.add(WarningKind::BadStatement, || {
                        format!("line {line}: usemtl without a name")
                    });
                    self.material = None;
                } else {
                    let next = self.out.materials.len();
                    let index = *self.materials.entry(name.to_owned()).or_insert(next);
                    if index == next {
                        self.out.materials.push(name.to_owned());
                        self.out.material_lines.push(line);
                    }
                    self.material = Some(index);
                }
            }
            "mtllib" => {
                if rest.trim().is_empty() {
                    warnings.add(WarningKind::BadStatement, || {
                        format!("line {line}: mtllib without a name")
                    });
                } else {
                    self.out.libraries.push((rest.trim().to_owned(), line));
                }
            }
            // Smoothing groups ask for invented normals; display attributes and parameter-space points draw nothing.
            "s" | "vp" | "vw" | "mg" | "lod" | "bevel" | "c_interp" | "d_interp" | "usemap" | "maplib" => {}
            "l" => ignored(warnings, "lines"),
            "p" => ignored(warnings, "points"),
            "curv" | "curv2" | "surf" | "cstype" | "deg" | "bmat" | "step" | "parm" | "trim" | "hole"
            | "scrv" | "sp" | "end" | "con" | "bzp" | "bsp" | "res" | "cdc" | "cdp" | "ctech" | "stech" => {
                ignored(warnings, "curves and curved surfaces");
            }
            "call" | "csh" => ignored(warnings, "calls"),
            "shadow_obj" | "trace_obj" => {}
            "t" => ignored(warnings, "statement t"),
            _ => warnings.add(WarningKind::BadStatement, || format!("line {line}: {text}")),
        }
    }

    /// A vertex, texture coordinate or normal; a bad one keeps its number but will not be used.
    fn attribute(&mut self, which: usize, line: u32, data: &str, warnings: &mut Warnings) {
        let mut numbers = [0.0f64; 3];
        let mut count = 0;
        let mut readable = true;
        for token in data.split_ascii_whitespace() {
            if let Some(number) = numbers.get_mut(count) {
                match token.parse() {
                    Ok(value) => *number = value,
                    Err(_) => readable = false,
                }
            }
            count += 1;
        }
        let (keyword, needed, good) = match which {
            VERTEX => ("v", 3, numbers.iter().all(|x| x.abs() <= FARTHEST)),
            UV => ("vt", 1, numbers.iter().all(|x| x.abs() <= f64::from(f32::MAX))),
            _ => {
                let length: f64 = numbers.iter().map(|x| x * x).sum();
                ("vn", 3, length > 0.0 && length.is_finite())
            }
        };
        let readable = readable && count >= needed;
        if readable && good {
            let used = if which == UV { 2 } else { 3 };
            if count == used {
                self.out.vertices.push_str(keyword);
                self.out.vertices.push(' ');
                self.out.vertices.push_str(data);
                self.out.vertices.push('\n');
            } else {
                // Curve weights, colours and a third texture coordinate go; a missing second coordinate is 0.
                self.write_numbers(keyword, &numbers[..used]);
                if which == VERTEX && count > 4 {
                    warnings.add(WarningKind::Ignored, || format!("vertex colours (line {line})"));
                }
            }
        } else {
            let index = self.attributes.seen[which];
            self.attributes.bad[which].push(index);
            self.write_numbers(keyword, &[0.0; 3][..if which == UV { 2 } else { 3 }]);
            let kind = match (readable, which) {
                (false, _) => WarningKind::BadStatement,
                (true, VERTEX) => WarningKind::BadVertex,
                (true, _) => WarningKind::BadAttribute,
            };
            warnings.add(kind, || format!("line {line}: {keyword} {}", data.trim()));
        }
        self.attributes.seen[which] += 1;
    }

    fn write_numbers(&mut self, keyword: &str, numbers: &[f64]) {
        self.out.vertices.push_str(keyword);
        for number in numbers {
            write!(self.out.vertices, " {number}").expect("writing to a string");
        }
        self.out.vertices.push('\n');
    }

    fn face(&mut self, line: u32, data: &str, warnings: &mut Warnings) {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        let mut problem = None;
        let (mut every, mut any) = ([true; 3], [false; 3]);
        let mut verbatim = true;
        for token in data.split_ascii_whitespace() {
            let mut corner = [None; 3];
            for (which, part) in token.split('/').enumerate() {
                if which >= 3 {
                    problem = Some((WarningKind::BadStatement, token));
                    break;
                }
                if part.is_empty() {
                    continue;
                }
                let Ok(number) = part.parse::<i64>() else {
                    problem = Some((WarningKind::BadStatement, token));
                    break;
                };
                verbatim &= number > 0;
                any[which] = true;
                corner[which] = self.resolve(which, number);
            }
            if corner[VERTEX].is_none() && problem.is_none() {
                problem = Some((WarningKind::BadIndex, token));
            }
            for which in [UV, NORMAL] {
                every[which] &= corner[which].is_some();
            }
            corners.push(corner);
        }
        if problem.is_none() && corners.len() < 3 {
            problem = Some((WarningKind::BadPolygon, data.trim()));
        }
        if let Some((kind, part)) = problem {
            warnings.add(kind, || format!("line {line}: {part}"));
            self.corners = corners;
            return;
        }
        let is_bad = |which: usize, index: Option<usize>| {
            index.is_some_and(|index| self.attributes.bad[which].binary_search(&index).is_ok())
        };
        if corners.iter().any(|corner| is_bad(VERTEX, corner[VERTEX])) {
            // Its vertex has been reported.
            self.corners = corners;
            return;
        }
        for which in [UV, NORMAL] {
            if any[which] && !every[which] {
                let what = if which == UV {
                    "texture coordinate"
                } else {
                    "normal"
                };
                warnings.add(WarningKind::BadAttributeIndex, || format!("line {line}: {what}"));
                verbatim = false;
            } else if every[which] && corners.iter().any(|corner| is_bad(which, corner[which])) {
                every[which] = false;
                verbatim = false;
            }
        }
        let kind = CornerKind {
            uv: every[UV],
            normal: every[NORMAL],
        };
        let bucket = self.bucket(kind);
        let text = &mut bucket.text;
        bucket.lines.push(line);
        text.push('f');
        if verbatim {
            text.push(' ');
            text.push_str(data);
        } else {
            for corner in &corners {
                let number = |which: usize| corner[which].map_or(0, |index| index + 1);
                write!(text, " {}", number(VERTEX)).expect("writing to a string");
                match (kind.uv, kind.normal) {
                    (true, true) => write!(text, "/{}/{}", number(UV), number(NORMAL)),
                    (true, false) => write!(text, "/{}", number(UV)),
                    (false, true) => write!(text, "//{}", number(NORMAL)),
                    (false, false) => Ok(()),
                }
                .expect("writing to a string");
            }
        }
        text.push('\n');
        self.corners = corners;
    }

    /// Position of element `number` (from 1, or backwards from -1), if there is one.
    fn resolve(&self, which: usize, number: i64) -> Option<usize> {
        let index = if number < 0 {
            i64::try_from(self.attributes.seen[which])
                .ok()?
                .checked_add(number)?
        } else {
            number - 1
        };
        usize::try_from(index)
            .ok()
            .filter(|&index| index < self.attributes.total[which])
    }

    fn bucket(&mut self, kind: CornerKind) -> &mut Bucket {
        let object = match self.current_object {
            Some(object) => object,
            None => {
                let name = match (self.object.as_str(), self.group.as_str()) {
                    (object, "") => object.to_owned(),
                    ("", group) => group.to_owned(),
                    (object, group) => format!("{object}/{group}"),
                };
                let next = self.out.objects.len();
                let index = *self.objects.entry(name.clone()).or_insert(next);
                if index == next {
                    self.out.objects.push(name);
                }
                self.current_object = Some(index);
                index
            }
        };
        let material = self.material;
        let next = self.out.buckets.len();
        let index = *self.buckets.entry((object, material, kind)).or_insert(next);
        if index == next {
            let (lines, text) = (Vec::new(), String::new());
            self.out.buckets.push(Bucket {
                object,
                material,
                kind,
                lines,
                text,
            });
        }
        &mut self.out.buckets[index]
    }
}
