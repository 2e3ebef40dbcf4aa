//! Copies of inputs in which all rows but those asked for are unusable.

use crate::InputSource;
use crate::plan::Need;
use isospline_artifact::{Section, SectionSource, SectionSpec};

/// NaN as `f64`, `u32::MAX` as an index.
const POISON: u64 = u64::MAX;

/// Poisoned artifacts, by kind.
#[derive(Debug, Default)]
pub(super) struct Poisoned(Vec<(&'static str, Rows)>);

#[derive(Debug)]
struct Rows(Vec<OwnedSection>);

#[derive(Debug)]
struct OwnedSection {
    name: &'static str,
    stride: usize,
    length: usize,
    /// `u64`, so that any row type finds its alignment.
    words: Vec<u64>,
}

impl Poisoned {
    /// Adds a copy of `rows` that holds only what `needs` name.
    pub(super) fn add(
        &mut self,
        kind: &'static str,
        specs: &[SectionSpec],
        rows: &dyn SectionSource,
        needs: &[&Need],
    ) {
        let known = |n: &&Need| specs.iter().any(|s| s.name == n.section);
        assert!(needs.iter().all(known), "a task needs a section that {kind} does not have");
        let section = |spec: &SectionSpec| {
            let section = rows.section(spec.name).expect("the fixture has all sections");
            let needs = needs.iter().filter(|n| n.section == spec.name);
            OwnedSection::keeping(spec.name, section, needs.copied())
        };
        self.0.push((kind, Rows(specs.iter().map(section).collect())));
    }
}

impl OwnedSection {
    fn keeping<'n>(
        name: &'static str,
        section: Section<'_>,
        needs: impl Iterator<Item = &'n Need>,
    ) -> Self {
        let length = section.bytes.len();
        let mut words = vec![POISON; length.div_ceil(8)];
        let copy: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
        for rows in needs.flat_map(|n| &n.rows) {
            let bytes = rows.start * section.stride..rows.end * section.stride;
            assert!(bytes.end <= length, "a task needs rows {rows:?} of {name}: beyond the end");
            copy[bytes.clone()].copy_from_slice(&section.bytes[bytes]);
        }
        Self { name, stride: section.stride, length, words }
    }
}

impl InputSource for Poisoned {
    fn input(&self, kind: &str) -> Option<&dyn SectionSource> {
        self.0.iter().find(|(k, _)| *k == kind).map(|(_, rows)| rows as &dyn SectionSource)
    }
}

impl SectionSource for Rows {
    fn section(&self, name: &str) -> Option<Section<'_>> {
        let found = self.0.iter().find(|s| s.name == name)?;
        let bytes = &bytemuck::cast_slice(&found.words)[..found.length];
        Some(Section { stride: found.stride, bytes })
    }
}
