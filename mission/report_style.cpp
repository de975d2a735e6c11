#include "mission/drawing.hpp"
#include "mission/report_parts.hpp"

namespace mission::report {
namespace {

constexpr std::string_view kPage = R"(
@media (prefers-color-scheme: dark) { :root {
  --page: #12161b; --card: #1b2129; --ink: #e6eaf0; --soft: #9aa7b5; --line: #303945;
  --covered: #4ea8e8; --missed: #ff8a4c; --other: #788494; --solid: #3b4551; --road: #6d6790;
  --driven: #41c795; --view: #e07ad0; --badge: #dfe6ee; --badge-ink: #12161b;
  --good: #41c795; --warn: #f0b45a; --alarm: #43241f; } }
@media print { :root { color-scheme: light;
  --page: #ffffff; --card: #ffffff; --ink: #111; --soft: #444; --line: #ccc;
  --covered: #0b6fb8; --missed: #d9480f; --other: #8b95a1; --solid: #cfd5dc; --road: #a9a3c2;
  --driven: #12805c; --view: #a3268f; --badge: #243244; --badge-ink: #ffffff;
  --good: #12805c; --warn: #b45309; --alarm: #fdecea; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 28px 20px 48px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0; letter-spacing: -0.01em; overflow-wrap: anywhere; }
h2 { font-size: 19px; margin: 0 0 12px; }
h3 { font-size: 15px; margin: 20px 0 6px; }
p { margin: 6px 0; }
.sub { color: var(--soft); margin: 4px 0 16px; overflow-wrap: anywhere; }
.outcome { border-left: 5px solid var(--good); background: var(--card); padding: 12px 16px;
  border-radius: 6px; margin: 0 0 18px; box-shadow: 0 0 0 1px var(--line); overflow-wrap: anywhere; }
.outcome.early { border-left-color: var(--warn); }
.outcome b { color: var(--good); } .outcome.early b { color: var(--warn); }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(215px, 1fr)); gap: 12px;
  margin: 0 0 18px; }
.figure { background: var(--card); border-radius: 8px; padding: 12px 14px;
  box-shadow: 0 0 0 1px var(--line); }
.figure b { display: block; font-size: 23px; line-height: 1.25; font-variant-numeric: tabular-nums; }
.figure span { color: var(--soft); font-size: 13px; }
section { background: var(--card); border-radius: 8px; padding: 18px 20px; margin: 0 0 18px;
  box-shadow: 0 0 0 1px var(--line); }
.scroll { overflow-x: auto; margin: 8px 0; }
table { border-collapse: collapse; width: 100%; font-size: 13.5px;
  font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 5px 10px; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th { color: var(--soft); font-weight: 600; font-size: 12.5px; vertical-align: bottom; }
th:first-child, td:first-child { padding-left: 4px; }
.n { text-align: right; white-space: nowrap; }
.w { white-space: nowrap; } th.n, th.w { white-space: normal; }
tr.strong td { font-weight: 650; }
tr.view td:first-child { box-shadow: inset 3px 0 0 var(--view); padding-left: 10px; }
tr.alarm td { background: var(--alarm); }
.small { color: var(--soft); font-size: 13.5px; margin: 6px 0; padding-left: 20px; }
.hint { color: var(--soft); font-size: 13.5px; max-width: 80ch; }
details summary { cursor: pointer; color: var(--soft); font-size: 13.5px; }
ul.plain { margin: 6px 0; padding-left: 20px; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 20px;
  align-items: start; }
svg { display: block; width: 100%; height: auto; margin: 0 auto; }
svg text { font-family: inherit; fill: var(--ink); font-size: 12px; }
svg.chart { max-width: 620px; margin: 0; }
.legend { display: flex; flex-wrap: wrap; gap: 6px 18px; font-size: 13px; color: var(--soft);
  margin: 12px 0 0; padding: 0; list-style: none; }
.legend li { display: flex; align-items: center; gap: 7px; }
.legend svg { width: 30px; height: 18px; flex: none; }
.legend b { color: var(--ink); font-weight: 600; }
)";

constexpr std::string_view kCharts = R"(
.grid { stroke: var(--line); stroke-width: 1; }
.axis { stroke: var(--soft); stroke-width: 1; }
svg .tick { fill: var(--soft); font-size: 11px; }
svg .title { font-weight: 600; font-size: 13px; }
svg .c-text { fill: var(--covered); font-weight: 600; } svg .m-text { fill: var(--missed); font-weight: 600; }
.c-line { fill: none; stroke: var(--covered); stroke-width: 2; }
.m-line { fill: none; stroke: var(--missed); stroke-width: 2; }
.c-dot { fill: var(--covered); } .m-dot { fill: var(--missed); } .v-dot { fill: var(--view); }
.v-ring { fill: none; stroke: var(--view); stroke-width: 1.5; }
.v-zone { fill: var(--view); fill-opacity: 0.07; }
.limit { stroke: var(--soft); stroke-width: 1.2; stroke-dasharray: 5 4; }
.claim { stroke: var(--covered); stroke-opacity: 0.35; stroke-width: 7; }
footer { color: var(--soft); font-size: 13px; }
@page { size: A4; margin: 14mm; }
@media print { body { font-size: 10pt; } main { max-width: none; padding: 0; }
  section, .figure, .outcome { box-shadow: none; border: 1px solid var(--line); }
  .outcome { border-left: 5px solid var(--good); }
  section { padding: 10px 12px; } h2 { break-after: avoid; } tr, svg, .figure { break-inside: avoid; }
  table { font-size: 6.9pt; } th { font-size: 6.6pt; } th, td { padding: 2px 3px; }
  .pair { grid-template-columns: 1fr; }
  .scroll { overflow: visible; } details::details-content { content-visibility: visible; }
  * { -webkit-print-color-adjust: exact; print-color-adjust: exact; } }
)";

}  // namespace

std::string style() {
  return ":root { color-scheme: light dark;\n" + std::string(drawing::palette()) + " }" +
         std::string(kPage) + std::string(drawing::rules()) + std::string(kCharts);
}

}  // namespace mission::report
