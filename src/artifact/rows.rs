//! An artifact is a set of named sections of fixed-size little-endian rows.
//!
//! [`artifact!`](crate::artifact) declares a kind once: the owned struct that a stage fills, the
//! borrowed view that the next stage reads, and the section table that the container stores.

use std::fmt::Debug;

/// A row type: plain data without padding, the same bytes in memory and on disk.
pub trait Row: bytemuck::Pod + Send + Sync + Debug {}
impl<T: bytemuck::Pod + Send + Sync + Debug> Row for T {}

/// What the rows of a section count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Count {
    /// One row.
    One,
    /// One row a vertex.
    Vertices,
    /// One row a vertex and a closing one.
    VerticesPlusOne,
    /// One row an edge.
    Edges,
    /// One row a face.
    Faces,
    /// Three rows a face.
    HalfEdges,
    /// One row a sector: one a smooth vertex, several at a crease.
    Sectors,
    /// One row a sector, or none.
    SectorsOrNone,
    /// One row a fan of faces about a vertex.
    Fans,
}

/// Name, row size and meaning of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SectionSpec {
    /// Name, unique in its kind.
    pub name: &'static str,
    /// Bytes a row.
    pub stride: usize,
    /// What the rows count.
    pub count: Count,
}

/// A section's rows as bytes.
#[derive(Clone, Copy, Debug)]
pub struct Section<'a> {
    /// Bytes a row.
    pub stride: usize,
    /// All rows, aligned to 8 bytes.
    pub bytes: &'a [u8],
}

/// Anything that holds sections: an owned artifact, a mapped file, a memory store.
pub trait SectionSource: Send + Sync {
    /// The section of this name.
    fn section(&self, name: &str) -> Option<Section<'_>>;
}

/// Why sections do not have the shape of their kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RowsError {
    /// A section is not there.
    #[error("section {section:?} of kind {kind:?} is missing")]
    Missing {
        /// Artifact kind.
        kind: &'static str,
        /// Section name.
        section: &'static str,
    },
    /// A section has rows of another size or a broken length.
    #[error(
        "section {section:?} of kind {kind:?} has {found} bytes a row, {expected} are expected"
    )]
    Stride {
        /// Artifact kind.
        kind: &'static str,
        /// Section name.
        section: &'static str,
        /// Row size found.
        found: usize,
        /// Row size of this version.
        expected: usize,
    },
    /// Two sections that count the same thing have different numbers of rows.
    #[error("section {section:?} of kind {kind:?} has {found} rows where {expected} are expected")]
    Length {
        /// Artifact kind.
        kind: &'static str,
        /// Section name.
        section: &'static str,
        /// Rows found.
        found: usize,
        /// Rows of the other sections.
        expected: usize,
    },
}

/// A kind of artifact: declared by [`artifact!`](crate::artifact).
pub trait Artifact: SectionSource + Default + Clone + Debug + PartialEq + 'static {
    /// Name of the kind, as the header stores it.
    const KIND: &'static str;
    /// Version of the sections; raised when they change.
    const SCHEMA: u32;
    /// The section table.
    const SECTIONS: &'static [SectionSpec];
    /// The borrowed view.
    type View<'a>: View<'a>;

    /// Borrows typed rows from `source`.
    ///
    /// # Errors
    /// [`RowsError`] if a section is missing or has another shape.
    fn open(source: &dyn SectionSource) -> Result<Self::View<'_>, RowsError>;

    /// All sections as bytes, in table order.
    fn sections(&self) -> Vec<Section<'_>> {
        let find = |spec: &SectionSpec| self.section(spec.name);
        Self::SECTIONS.iter().map(|s| find(s).expect("invariant: own section")).collect()
    }
}

/// A borrowed view of an artifact.
pub trait View<'a>: Copy + Debug + Send + Sync + Sized {
    /// Name of the kind that it reads.
    const KIND: &'static str;

    /// Borrows typed rows from `source`.
    ///
    /// # Errors
    /// [`RowsError`] if a section is missing or has another shape.
    fn from_source(source: &'a dyn SectionSource) -> Result<Self, RowsError>;
}

/// Typed rows of one section.
///
/// # Errors
/// [`RowsError::Missing`] or [`RowsError::Stride`].
pub fn typed<'a, T: Row>(
    source: &'a dyn SectionSource,
    kind: &'static str,
    section: &'static str,
) -> Result<&'a [T], RowsError> {
    let found = source.section(section).ok_or(RowsError::Missing { kind, section })?;
    let expected = size_of::<T>();
    let stride = |found| RowsError::Stride { kind, section, found, expected };
    if found.stride != expected {
        return Err(stride(found.stride));
    }
    bytemuck::try_cast_slice(found.bytes).map_err(|_| stride(found.bytes.len() % expected))
}

/// Declares a kind: owned rows, borrowed view, section table.
#[macro_export]
macro_rules! artifact {
    (
        $(#[$doc:meta])*
        pub struct $owned:ident / $view:ident = $kind:literal, schema $schema:literal {
            $( $(#[$field_doc:meta])* $field:ident : $row:ty, $count:ident; )*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct $owned {
            $( $(#[$field_doc])* pub $field: Vec<$row>, )*
        }

        #[doc = concat!("Borrowed rows of [`", stringify!($owned), "`].")]
        #[derive(Clone, Copy, Debug)]
        pub struct $view<'a> {
            $( $(#[$field_doc])* pub $field: &'a [$row], )*
        }

        impl $owned {
            /// Borrows all rows.
            pub fn view(&self) -> $view<'_> {
                $view { $( $field: &self.$field, )* }
            }
        }

        impl $view<'_> {
            /// Copies all rows.
            pub fn to_owned_rows(self) -> $owned {
                $owned { $( $field: self.$field.to_vec(), )* }
            }
        }

        impl $crate::SectionSource for $owned {
            fn section(&self, name: &str) -> Option<$crate::Section<'_>> {
                match name {
                    $( stringify!($field) => Some($crate::Section {
                        stride: size_of::<$row>(),
                        bytes: bytemuck::cast_slice(&self.$field),
                    }), )*
                    _ => None,
                }
            }
        }

        impl $crate::Artifact for $owned {
            const KIND: &'static str = $kind;
            const SCHEMA: u32 = $schema;
            const SECTIONS: &'static [$crate::SectionSpec] = &[
                $( $crate::SectionSpec {
                    name: stringify!($field),
                    stride: size_of::<$row>(),
                    count: $crate::Count::$count,
                }, )*
            ];
            type View<'a> = $view<'a>;

            fn open(source: &dyn $crate::SectionSource) -> Result<$view<'_>, $crate::RowsError> {
                <$view<'_> as $crate::View<'_>>::from_source(source)
            }
        }

        impl<'a> $crate::View<'a> for $view<'a> {
            const KIND: &'static str = $kind;

            fn from_source(
                source: &'a dyn $crate::SectionSource,
            ) -> Result<Self, $crate::RowsError> {
                Ok(Self {
                    $( $field: $crate::rows::typed(source, $kind, stringify!($field))?, )*
                })
            }
        }
    };
}
