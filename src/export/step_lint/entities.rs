//! Entities by number, with arguments of the kinds that are asked for.

use super::StepDefect;
use super::part21::{Entity, Value, arguments, references};

/// Something read from the file, or why that cannot be.
pub(super) type Found<T> = Result<T, StepDefect>;

/// The entities of a file, ascending.
#[derive(Debug)]
pub(super) struct Model<'a> {
    pub(super) entities: Vec<Entity<'a>>,
}

/// An entity and its arguments.
#[derive(Debug)]
pub(super) struct Node<'a> {
    pub(super) number: u64,
    pub(super) kind: &'a str,
    arguments: Vec<Value<'a>>,
}

impl<'a> Model<'a> {
    /// Sorts the entities; notes numbers that are there twice or not at all.
    pub(super) fn new(mut entities: Vec<Entity<'a>>, defects: &mut Vec<StepDefect>) -> Self {
        entities.sort_by_key(|entity| entity.number);
        let pairs = entities.windows(2).filter(|pair| pair[0].number == pair[1].number);
        defects.extend(pairs.map(|pair| StepDefect::Repeated(pair[0].number)));
        let model = Self { entities };
        for entity in &model.entities {
            let from = entity.number;
            let lost = references(entity.arguments).filter(|&to| model.find(to).is_none());
            defects.extend(lost.map(|missing| StepDefect::Dangling { from, missing }));
        }
        model
    }

    /// All entities of a kind, with their arguments.
    pub(super) fn all(&self, kind: &'a str) -> impl Iterator<Item = Found<Node<'a>>> {
        self.entities.iter().filter(move |entity| entity.kind == kind).map(Node::new)
    }

    /// The entity that `from` names, which has to be one of these kinds.
    pub(super) fn get(
        &self,
        from: u64,
        to: u64,
        kinds: &[&str],
        wanted: &'static str,
    ) -> Found<Node<'a>> {
        let entity = self.find(to).ok_or(StepDefect::Dangling { from, missing: to })?;
        if !kinds.contains(&entity.kind) {
            return Err(StepDefect::Kind { from, to, wanted });
        }
        Node::new(entity)
    }

    /// Coordinates of a point in space.
    pub(super) fn point(&self, from: u64, to: u64) -> Found<[f64; 3]> {
        let node = self.get(from, to, &["CARTESIAN_POINT"], "a point")?;
        let numbers = node.numbers(1)?;
        let wrong = StepDefect::Argument { entity: to, argument: 2, wanted: "three numbers" };
        numbers.try_into().map_err(|_| wrong)
    }

    /// The entity of a number.
    pub(super) fn find(&self, number: u64) -> Option<&Entity<'a>> {
        // Numbers that run without gaps, as the writer's do, need no search.
        let first = self.entities.first()?.number;
        let guess = self.entities.get(number.checked_sub(first)? as usize);
        guess.filter(|entity| entity.number == number).or_else(|| {
            let at = self.entities.binary_search_by_key(&number, |entity| entity.number);
            at.ok().map(|at| &self.entities[at])
        })
    }
}

impl<'a> Node<'a> {
    fn new(entity: &Entity<'a>) -> Found<Self> {
        let &Entity { number, kind, arguments: text } = entity;
        let arguments =
            arguments(text).ok_or_else(|| StepDefect::Syntax(format!("#{number}={kind}(...)")))?;
        Ok(Self { number, kind, arguments })
    }

    pub(super) fn reference(&self, k: usize) -> Found<u64> {
        match self.arguments.get(k) {
            Some(&Value::Reference(number)) => Ok(number),
            _ => Err(self.wrong(k, "a reference")),
        }
    }

    pub(super) fn flag(&self, k: usize) -> Found<bool> {
        match self.arguments.get(k) {
            Some(&Value::Flag(flag)) => Ok(flag),
            _ => Err(self.wrong(k, ".T. or .F.")),
        }
    }

    pub(super) fn number(&self, k: usize) -> Found<f64> {
        match self.arguments.get(k) {
            Some(&Value::Number(number)) => Ok(number),
            _ => Err(self.wrong(k, "a number")),
        }
    }

    pub(super) fn list(&self, k: usize) -> Found<&[Value<'a>]> {
        match self.arguments.get(k) {
            Some(Value::List(values)) => Ok(values),
            _ => Err(self.wrong(k, "a list")),
        }
    }

    pub(super) fn references(&self, k: usize) -> Found<Vec<u64>> {
        let number = |value: &Value<'_>| match value {
            Value::Reference(number) => Ok(*number),
            _ => Err(self.wrong(k, "a list of references")),
        };
        self.list(k)?.iter().map(number).collect()
    }

    pub(super) fn numbers(&self, k: usize) -> Found<Vec<f64>> {
        let number = |value: &Value<'_>| match value {
            Value::Number(number) => Ok(*number),
            _ => Err(self.wrong(k, "a list of numbers")),
        };
        self.list(k)?.iter().map(number).collect()
    }

    /// The number within a typed argument, such as `VOLUME_MEASURE(2.)`.
    pub(super) fn measure(&self, k: usize, kind: &str) -> Option<f64> {
        match self.arguments.get(k) {
            Some(Value::Typed(found, inner)) if *found == kind => match inner[..] {
                [Value::Number(number)] => Some(number),
                _ => None,
            },
            _ => None,
        }
    }

    pub(super) fn wrong(&self, k: usize, wanted: &'static str) -> StepDefect {
        StepDefect::Argument { entity: self.number, argument: k + 1, wanted }
    }
}
