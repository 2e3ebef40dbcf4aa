//! What can be wrong with a STEP file.

/// Something wrong in a STEP file; entities are named by their numbers.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepDefect {
    /// It does not begin, end or hold a data section as the standard says.
    #[error("the file lacks {0}")]
    Frame(&'static str),
    /// A statement of the data section cannot be read.
    #[error("cannot read {0:?}")]
    Syntax(String),
    /// Two entities have one number.
    #[error("#{0} is there twice")]
    Repeated(u64),
    /// An entity names one that is not there.
    #[error("#{from} names #{missing}, which is not there")]
    Dangling {
        /// The entity.
        from: u64,
        /// What it names.
        missing: u64,
    },
    /// An entity names one of the wrong kind.
    #[error("#{from} names #{to}, which should be {wanted}")]
    Kind {
        /// The entity.
        from: u64,
        /// What it names.
        to: u64,
        /// What it should be.
        wanted: &'static str,
    },
    /// An argument is not what its kind of entity wants.
    #[error("argument {argument} of #{entity} is not {wanted}")]
    Argument {
        /// The entity.
        entity: u64,
        /// The argument, from 1.
        argument: usize,
        /// What it should be.
        wanted: &'static str,
    },
    /// Numbers of control points, multiplicities and degree do not fit together.
    #[error("#{entity} has {found} {what}, not {expected}")]
    Count {
        /// The entity.
        entity: u64,
        /// What is counted.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// No solid is in the representation of the product's shape.
    #[error("there is no solid in a shape representation")]
    NoSolid,
    /// A solid, shell or face belongs to none of what it could be part of, or to several.
    #[error("{what} #{entity} is used {times} times, not once")]
    Use {
        /// The entity.
        entity: u64,
        /// What it is.
        what: &'static str,
        /// How often it is used.
        times: usize,
    },
    /// An edge does not have a face on either side.
    #[error("edge #{edge} is used {forward} times along and {backward} against its direction")]
    EdgeUse {
        /// The edge.
        edge: u64,
        /// Uses along its direction.
        forward: usize,
        /// Uses against it.
        backward: usize,
    },
    /// The next edge of a loop starts elsewhere.
    #[error("the loop of face #{face} is open after edge #{edge}")]
    OpenLoop {
        /// The face.
        face: u64,
        /// The edge whose end is not met.
        edge: u64,
    },
    /// Faces around a vertex form several fans.
    #[error("shell #{shell} touches itself at vertex #{vertex}")]
    Pinched {
        /// The shell.
        shell: u64,
        /// The vertex.
        vertex: u64,
    },
    /// A curve does not start and end at the vertices of its edge.
    #[error("the curve of edge #{edge} does not join its vertices in all bits")]
    Ends {
        /// The edge.
        edge: u64,
    },
    /// A surface's border is not the curve of the edge there.
    #[error("the border of face #{face} along edge #{edge} is not its curve in all bits")]
    Border {
        /// The face.
        face: u64,
        /// The edge.
        edge: u64,
    },
    /// A loop runs clockwise about the normal of its face.
    #[error("face #{face} is turned over")]
    TurnedFace {
        /// The face.
        face: u64,
    },
    /// A curve in the parameters of a face is not the side that its edge is.
    #[error("a curve of edge #{edge} in the parameters of a face is another side")]
    Pcurve {
        /// The edge.
        edge: u64,
    },
    /// A shell bounds the wrong side.
    #[error("shell #{shell} is turned inside out: its volume is {volume:e}")]
    TurnedShell {
        /// The shell.
        shell: u64,
        /// Its volume.
        volume: f64,
    },
    /// The surfaces do not hold the volume among the validation properties.
    #[error("the surfaces hold {found:e}, {stated:e} is stated")]
    Volume {
        /// Volume within the surfaces.
        found: f64,
        /// Volume that the file states.
        stated: f64,
    },
    /// Something that a reader needs is not said.
    #[error("the file does not say {0}")]
    Unsaid(&'static str),
}
