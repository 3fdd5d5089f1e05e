//! `modelDescription.xml` of an FMU.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::fmu::{FIRST_OUTPUT, OUTPUTS, STATUS, Variable};
use super::plan::Plan;

/// The description of a unit of these variables.
pub(super) fn xml(plan: &Plan, inputs: &[Variable], settings: &[Variable], terms: &[Variable], guid: &str) -> String {
    let stem = &plan.prefix;
    let name = if plan.model.name.is_empty() { stem } else { &plan.model.name };
    let mut units: BTreeSet<&str> = OUTPUTS.iter().map(|(_, _, unit, _)| *unit).collect();
    units.extend(inputs.iter().chain(settings).chain(terms).map(|variable| variable.unit));
    let units: String = units.iter().map(|unit| format!("    <Unit name=\"{unit}\"/>\n")).collect();

    let mut variables = Variables::default();
    for input in inputs {
        let real = format!("<Real unit=\"{}\" start=\"{:?}\"/>", input.unit, input.start);
        variables.add(
            input.reference,
            &input.name,
            &input.words,
            "causality=\"input\" variability=\"continuous\"",
            &real,
        );
    }
    let first = variables.count + 1;
    for (number, (_, name, unit, words)) in OUTPUTS.iter().enumerate() {
        let kind = "causality=\"output\" variability=\"continuous\" initial=\"calculated\"";
        variables.add(FIRST_OUTPUT + number as u32, name, words, kind, &format!("<Real unit=\"{unit}\"/>"));
    }
    let words = "flags: 2 input refused, 4 beyond the rated deflection";
    let kind = "causality=\"output\" variability=\"discrete\" initial=\"calculated\"";
    variables.add(STATUS, "status", words, kind, "<Integer/>");
    let last = variables.count;
    for parameter in settings.iter().chain(terms) {
        let variability = if parameter.fixed { "fixed" } else { "tunable" };
        let kind = format!("causality=\"parameter\" variability=\"{variability}\" initial=\"exact\"");
        let real = format!("<Real unit=\"{}\" start=\"{:?}\"/>", parameter.unit, parameter.start);
        variables.add(parameter.reference, &parameter.name, &parameter.words, &kind, &real);
    }
    let unknowns: String = (first..=last).map(|index| format!("      <Unknown index=\"{index}\"/>\n")).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{guid}\" description=\"Torque of a harmonic drive with hysteresis, law {law}\" \
         generationTool=\"gmhm {version}\" variableNamingConvention=\"structured\" numberOfEventIndicators=\"0\">\n\
         \x20 <CoSimulation modelIdentifier=\"{stem}\" canHandleVariableCommunicationStepSize=\"true\" canInterpolateInputs=\"true\" \
         canNotUseMemoryManagementFunctions=\"true\" canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\">\n\
         \x20   <SourceFiles>\n      <File name=\"{stem}.c\"/>\n      <File name=\"{stem}_fmu.c\"/>\n    </SourceFiles>\n  </CoSimulation>\n\
         \x20 <UnitDefinitions>\n{units}  </UnitDefinitions>\n\
         \x20 <LogCategories>\n    <Category name=\"logStatusWarning\"/>\n    <Category name=\"logStatusError\"/>\n  </LogCategories>\n\
         \x20 <DefaultExperiment stepSize=\"0.001\"/>\n\
         \x20 <ModelVariables>\n{variables}  </ModelVariables>\n\
         \x20 <ModelStructure>\n    <Outputs>\n{unknowns}    </Outputs>\n    <InitialUnknowns>\n{unknowns}    </InitialUnknowns>\n  </ModelStructure>\n\
         </fmiModelDescription>\n",
        name = escaped(name),
        law = plan.law.name(),
        version = env!("CARGO_PKG_VERSION"),
        variables = variables.text,
    )
}

/// `ScalarVariable`s in order; their places count from 1.
#[derive(Default)]
struct Variables {
    text: String,
    count: usize,
}

impl Variables {
    fn add(&mut self, reference: u32, name: &str, words: &str, kind: &str, value: &str) {
        self.count += 1;
        let _ = writeln!(
            self.text,
            "    <ScalarVariable name=\"{}\" valueReference=\"{reference}\" description=\"{}\" {kind}>{value}</ScalarVariable>",
            escaped(name),
            escaped(words)
        );
    }
}

/// A text within an attribute.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}
