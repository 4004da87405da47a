//! The page of a run: one self-contained file with interactive plots that needs no network.
//!
//! A content policy in the page forbids every request, so that it cannot fetch or send anything. Without scripts the
//! static figures are shown.

use std::fmt::Write as _;
use std::io::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

use super::groups::kind_text;
use super::{
    RunOptions, figure_file, orbit_data, page_sections as sections, plot_data, svg, table_file,
    table_files,
};
use crate::error::Error;
use crate::report::{Column, Report, Table, Values, readable, shown};

const STYLE: &str = include_str!("page.css");
/// Each uses what those before it define.
const SCRIPTS: [&str; 7] = [
    include_str!("page_plotting.js"),
    include_str!("page_theme.js"),
    include_str!("page_axes.js"),
    include_str!("page_orbit.js"),
    include_str!("page_reader.js"),
    include_str!("page.js"),
    include_str!("page_events.js"),
];
/// plotly.js, the bundle for plots in Cartesian coordinates, as the npm package `plotly.js-cartesian-dist-min` has it,
/// packed by gzip: a third of the length in the page.
const PLOTTING: &[u8] = include_bytes!("plotting/plotly-cartesian.min.js.gz");
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; \
                      style-src 'unsafe-inline'; img-src data: blob:";
/// Rows of events shown; the file has them all.
const EVENT_ROWS: usize = 200;

/// A page ready to be written.
#[derive(Debug)]
pub struct Page {
    text: String,
    has_plots: bool,
}

impl Page {
    /// Writes the page as one HTML document.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> std::io::Result<()> {
        out.write_all(self.text.as_bytes())?;
        if self.has_plots {
            out.write_all(b"<script type=\"text/plain\" id=\"plotting\">")?;
            out.write_all(STANDARD.encode(PLOTTING).as_bytes())?;
            out.write_all(b"</script>\n")?;
            for script in SCRIPTS {
                write!(out, "<script>\n{script}</script>\n")?;
            }
        }
        out.write_all(b"</body>\n</html>\n")
    }
}

/// The page of a run.
///
/// # Errors
///
/// `Error::Input` when a figure wants a table or column that its report does not have.
pub fn render(reports: &[Report], options: &RunOptions) -> Result<Page, Error> {
    let model = match options.model.trim() {
        "" => "Results",
        name => name,
    };
    let mut page = String::new();
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<a class=\"skip\" href=\"#results\">Skip to the results</a>\n<header>\n<h1>{title}</h1>\n",
        title = escape(model)
    );
    contents(&mut page, reports);
    page.push_str("</header>\n<main id=\"results\">\n");
    let stride = orbit_data::stride(reports);
    sections::model(&mut page, &options.description);
    if let Some(comparison) = &options.comparison {
        sections::comparison(&mut page, comparison);
    }
    for report in reports {
        section(&mut page, report, options, stride)?;
    }
    page.push_str("</main>\n");
    footer(&mut page, options);
    Ok(Page {
        text: page,
        has_plots: reports.iter().any(|r| r.figure.is_some()),
    })
}

fn contents(page: &mut String, reports: &[Report]) {
    let early = reports.iter().filter(|r| r.ended_early.is_some()).count();
    let _ = write!(
        page,
        "<p class=\"soft\">{} analys{}",
        reports.len(),
        if reports.len() == 1 { "is" } else { "es" }
    );
    if early > 0 {
        let _ = write!(page, ", {early} ended early");
    }
    page.push_str(".<span class=\"screen\"> Drag in a plot to zoom, double-click to zoom out, click a legend entry to hide it; with the keyboard, Tab to a plot and walk along its curves with the arrow keys.</span></p>\n");
    page.push_str("<nav aria-label=\"Contents\"><strong>Contents</strong>\n<ol>\n");
    for report in reports {
        let _ = writeln!(
            page,
            "<li><a href=\"#a-{}\">{}</a> <span class=\"tag\">{}</span>{}</li>",
            escape(&report.name),
            escape(heading(report)),
            escape(&report.kind),
            match report.ended_early {
                Some(_) => " <span class=\"tag early\">ended early</span>",
                None => "",
            }
        );
    }
    page.push_str("</ol></nav>\n");
}

fn heading(report: &Report) -> &str {
    match report.title.trim() {
        "" => &report.name,
        title => title,
    }
}

fn section(
    page: &mut String,
    report: &Report,
    options: &RunOptions,
    stride: usize,
) -> Result<(), Error> {
    let _ = write!(
        page,
        "<section id=\"a-{name}\">\n<h2>{}</h2>\n<p class=\"soft\">{name} <span class=\"tag\">{}</span></p>\n",
        escape(heading(report)),
        escape(&report.kind),
        name = escape(&report.name),
    );
    if !report.caption.is_empty() {
        let _ = writeln!(page, "<p>{}</p>", escape(&report.caption));
    }
    if let Some(reason) = &report.ended_early {
        let _ = writeln!(
            page,
            "<div class=\"note early\"><strong>Ended early:</strong> {}</div>",
            escape(reason)
        );
    }
    list(page, "Warnings", "note", &report.warnings);
    list(page, "Assumed", "soft", &report.assumed);
    plots(page, report, stride)?;
    if let Some(table) = report
        .main()
        .filter(|t| t.rows() == 1 && report.figure.is_none())
    {
        super::page_sections::one_row(page, table);
    }
    branches(page, report);
    if let Some(table) = report.table("events").filter(|t| t.rows() > 0) {
        events(page, report, table);
    }
    settings(page, report);
    files(page, report, options);
    page.push_str("</section>\n");
    Ok(())
}

fn list(page: &mut String, title: &str, class: &str, entries: &[String]) {
    if entries.is_empty() {
        return;
    }
    let _ = write!(page, "<div class=\"{class}\"><strong>{title}</strong><ul>");
    for entry in entries {
        let _ = write!(page, "<li>{}</li>", escape(entry));
    }
    page.push_str("</ul></div>\n");
}

fn plots(page: &mut String, report: &Report, stride: usize) -> Result<(), Error> {
    for (figure_name, figure) in report.figures() {
        let name = match figure_name {
            "" => escape(&report.name),
            figure => escape(&format!("{}.{figure}", report.name)),
        };
        let mut data = plot_data::value(figure, report)?;
        if figure_name.is_empty() {
            data["orbits"] = orbit_data::value(report, stride)?;
        }
        let data = data.to_string();
        let _ = write!(
            page,
            "<div class=\"plot\" data-source=\"data-{name}\" data-name=\"{name}\">\
             <img alt=\"{}\" src=\"data:image/svg+xml,{}\"></div>\n\
             <script type=\"application/json\" id=\"data-{name}\">{}</script>\n",
            escape(&figure.title),
            percent_encode(&svg::render(figure, report)?),
            // Inside JSON strings only; keeps </script> and <!-- from ending the element.
            shown(&data).replace('<', "\\u003c")
        );
    }
    Ok(())
}

/// How each branch ended, from `summary["branches"]`.
fn branches(page: &mut String, report: &Report) {
    let Some(Value::Array(branches)) = report.summary.get("branches") else {
        return;
    };
    if branches.is_empty() {
        return;
    }
    page.push_str("<h3>Branches</h3>\n");
    sections::open_table(page, &format!("Branches of {}", heading(report)), "");
    page.push_str("<th scope=\"col\">branch</th><th scope=\"col\">method</th><th scope=\"col\" class=\"number\">points</th><th scope=\"col\">end</th><th scope=\"col\">message</th></tr></thead><tbody>\n");
    for branch in branches {
        let end = &branch["end"];
        let _ = writeln!(
            page,
            "<tr><td>{}</td><td>{}</td><td class=\"number\">{}</td><td>{}</td><td>{}</td></tr>",
            plain(&branch["branch"]),
            plain(&branch["method"]),
            plain(&branch["points"]),
            plain(&end["reason"]).replace('_', " "),
            plain(&end["message"]),
        );
    }
    page.push_str("</tbody></table></div>\n");
}

fn plain(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => escape(text),
        other => escape(&other.to_string()),
    }
}

fn events(page: &mut String, report: &Report, table: &Table) {
    page.push_str("<h3>Events</h3>\n");
    sections::open_table(page, &format!("Events of {}", heading(report)), "events");
    for column in &table.columns {
        let unit = match column.unit.as_str() {
            "" => String::new(),
            unit => format!(" [{}]", escape(unit)),
        };
        let name = escape(&readable(&column.name));
        let class = class(column);
        let _ = write!(
            page,
            "<th scope=\"col\" class=\"{class}\">{name}{unit}</th>"
        );
    }
    page.push_str("</tr></thead><tbody>\n");
    for row in 0..table.rows().min(EVENT_ROWS) {
        page.push_str("<tr>");
        for column in &table.columns {
            let text = match &column.values {
                Values::Float(v) => short(v[row]),
                Values::Integer(v) => v[row].to_string(),
                Values::Text(v) => escape(&cell(&column.name, &v[row])),
            };
            let _ = write!(page, "<td class=\"{}\">{text}</td>", class(column));
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody></table></div>\n");
    if table.rows() > EVENT_ROWS {
        let _ = writeln!(
            page,
            "<p class=\"soft\">{EVENT_ROWS} of {} events; all of them are in {}.</p>",
            table.rows(),
            escape(&table_file(report, table))
        );
    }
}

/// Class of the cells of a column: numbers are right-aligned; columns that a narrow page omits are `spare`.
fn class(column: &Column) -> &'static str {
    let is_spare = ["bracket_", "rms.", "multiplicity", "after_point"]
        .iter()
        .any(|front| column.name.starts_with(front))
        || column.name.ends_with("_method");
    match (&column.values, is_spare) {
        (Values::Text(_), false) => "",
        (Values::Text(_), true) => "spare",
        (_, false) => "number",
        (_, true) => "number spare",
    }
}

fn cell(column: &str, text: &str) -> String {
    match column {
        "kind" => kind_text(text),
        _ => text.to_string(),
    }
}

/// Seven digits; empty for NaN.
pub(super) fn short(value: f64) -> String {
    match plot_data::rounded(value) {
        Value::Null => String::new(),
        number => number.to_string(),
    }
}

fn settings(page: &mut String, report: &Report) {
    for key in ["options", "scales"] {
        if let Some(value) = report.summary.get(key).filter(|v| !v.is_null()) {
            let _ = writeln!(
                page,
                "<details><summary>{key}</summary><pre>{}</pre></details>",
                escape(&format!("{value:#}"))
            );
        }
    }
}

fn files(page: &mut String, report: &Report, options: &RunOptions) {
    let mut names: Vec<String> = report
        .tables
        .iter()
        .flat_map(|table| table_files(report, table))
        .collect();
    names.push(format!("{}.json", report.name));
    for (figure, _) in report.figures() {
        let formats = options.figures.iter();
        names.extend(formats.map(|format| figure_file(report, figure, *format)));
    }
    let links: Vec<String> = names
        .iter()
        .map(|n| format!("<a href=\"./{0}\">{0}</a>", escape(n)))
        .collect();
    let _ = writeln!(page, "<p class=\"soft\">Files: {}</p>", links.join(", "));
}

fn footer(page: &mut String, options: &RunOptions) {
    let _ = writeln!(
        page,
        "<footer>\n<p class=\"soft\">Written by {} {}. Hashes of all files: <a href=\"./manifest.json\">manifest.json</a>.</p>",
        env!("CARGO_PKG_NAME"),
        env!("CARGO_PKG_VERSION"),
    );
    for input in &options.inputs {
        let _ = writeln!(
            page,
            "<p class=\"soft\">Input {}: <span class=\"hash\">SHA-256 {}</span></p>",
            escape(&input.name),
            escape(&input.sha256)
        );
    }
    page.push_str("</footer>\n");
}

/// Text made safe for content and for quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in shown(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// A document as the body of a data address: only what an address or the attribute around it cannot hold is encoded.
pub(super) fn percent_encode(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + text.len() / 8);
    for byte in text.bytes() {
        match byte {
            b' ' | b'!' | b'\'' | b'('..=b'/' | b'0'..=b';' | b'=' | b'?' | b'@' => {
                out.push(char::from(byte));
            }
            b'A'..=b'Z' | b'_' | b'a'..=b'z' | b'~' => out.push(char::from(byte)),
            _ => {
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plotting_script_is_whole_and_alone() {
        // The page of a run with many points stays below 3 MB.
        assert!(PLOTTING.len() < 600_000);
        let script = std::io::read_to_string(flate2::read::GzDecoder::new(PLOTTING)).unwrap();
        assert!(script.contains("newPlot") && !script.contains("MathJax.startup = "));
    }

    #[test]
    fn figures_survive_as_addresses() {
        assert_eq!(
            percent_encode("<a b=\"#1\">Ω 50%</a>"),
            "%3Ca b=%22%231%22%3E%CE%A9 50%25%3C/a%3E"
        );
    }
}
