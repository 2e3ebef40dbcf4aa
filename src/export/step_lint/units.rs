//! The unit of length of a shape representation.

use super::StepDefect;
use super::entities::{Found, Model};
use super::part21::{Value, arguments, parts};

/// The unit of length in metres, of the context of the shape representations.
pub(super) fn length(model: &Model<'_>) -> Found<f64> {
    let unsaid = || StepDefect::Unsaid("in what unit lengths are");
    let mut found: Option<f64> = None;
    for representation in model.all("ADVANCED_BREP_SHAPE_REPRESENTATION") {
        let context = representation?.reference(2)?;
        let units = part(model, context, "GLOBAL_UNIT_ASSIGNED_CONTEXT").ok_or_else(unsaid)?;
        let [Value::List(units)] = &units[..] else { return Err(unsaid()) };
        let number = |unit: &Value<'_>| match unit {
            Value::Reference(number) => Some(*number),
            _ => None,
        };
        let is_length = |number: &u64| part(model, *number, "LENGTH_UNIT").is_some();
        let unit = units.iter().filter_map(number).find(is_length).ok_or_else(unsaid)?;
        let metres = metres(model, unit).ok_or_else(unsaid)?;
        if found.is_some_and(|before| before.to_bits() != metres.to_bits()) {
            return Err(StepDefect::Unsaid("one unit for all its lengths"));
        }
        found = Some(metres);
    }
    found.ok_or_else(unsaid)
}

/// The arguments of a part of a complex entity.
fn part<'a>(model: &Model<'a>, number: u64, kind: &str) -> Option<Vec<Value<'a>>> {
    let entity = model.find(number).filter(|entity| entity.kind.is_empty())?;
    let found = parts(entity.arguments)?.into_iter().find(|(name, _)| *name == kind)?;
    arguments(found.1)
}

fn metres(model: &Model<'_>, unit: u64) -> Option<f64> {
    if let Some(si) = part(model, unit, "SI_UNIT") {
        let [Value::Other(prefix), Value::Other(".METRE")] = &si[..] else { return None };
        let prefixes =
            [("$", 1.0), (".CENTI", 1e-2), (".MILLI", 1e-3), (".MICRO", 1e-6), (".KILO", 1e3)];
        return prefixes.iter().find(|(name, _)| name == prefix).map(|(_, metres)| *metres);
    }
    let converted = part(model, unit, "CONVERSION_BASED_UNIT")?;
    let [_, Value::Reference(measure)] = &converted[..] else { return None };
    let measure =
        model.get(unit, *measure, &["LENGTH_MEASURE_WITH_UNIT"], "a measure with its unit").ok()?;
    let times = measure.measure(0, "LENGTH_MEASURE")?;
    // One step: a unit that is converted from itself would never end.
    let base = measure.reference(1).ok()?;
    part(model, base, "SI_UNIT").and_then(|_| metres(model, base)).map(|metres| times * metres)
}
