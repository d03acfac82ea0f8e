//! Writes the report as SARIF 2.1.0, whose findings code hosting services show next to the code.

use std::io::Write;

use anyhow::Result;
use host::fmi2::percent_encoded;
use serde_json::json;

use super::findings::Severity;
use super::report::Report;

pub fn write(report: &Report, out: &mut impl Write) -> Result<()> {
    let path = report.path.display().to_string().replace('\\', "/");
    let start = if path.starts_with('/') { "file://" } else { "" };
    let fmu = format!("{start}{}", percent_encoded(&path, b"/"));
    let rules: Vec<_> = report
        .outcomes
        .iter()
        .map(|outcome| {
            json!({
                "id": outcome.rule.id,
                "shortDescription": { "text": outcome.rule.title },
                "help": { "text": format!("{} [{}]", outcome.rule.title, outcome.rule.source) },
            })
        })
        .collect();
    let results: Vec<_> = report
        .all()
        .map(|(rule, finding)| {
            let level = match finding.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
            };
            json!({
                "ruleId": rule.id,
                "level": level,
                "message": { "text": format!("{}: {}", finding.place, finding.text) },
                // GitHub requires a line number.
                "locations": [{ "physicalLocation": {
                    "artifactLocation": { "uri": fmu }, "region": { "startLine": 1 }
                } }],
            })
        })
        .collect();
    let notifications: Vec<_> = report
        .unchecked
        .iter()
        .map(|why| json!({ "level": "error", "message": { "text": why } }))
        .collect();
    let file = json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "hubslosh check",
                "version": env!("CARGO_PKG_VERSION"),
                "rules": rules,
            } },
            "invocations": [{
                "executionSuccessful": report.unchecked.is_none(),
                "toolExecutionNotifications": notifications,
            }],
            "results": results,
        }],
    });
    serde_json::to_writer_pretty(&mut *out, &file)?;
    writeln!(out)?;
    Ok(())
}
