#include "mission/drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mission/report_html.hpp"

namespace mission::drawing {
namespace {

using Eigen::Vector2d;
using html::escaped;

constexpr double kWidthMax_px = 1060, kHeightMax_px = 940, kMargin_px = 16, kFoot_px = 46;
constexpr double kHead_px = 58, kLegendRow_px = 24, kLegendSign_px = 38, kCharacter_px = 7.0;

constexpr std::string_view kHatch =
    "<defs><pattern id=\"hatch\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" "
    "patternTransform=\"rotate(45)\"><line x1=\"0\" y1=\"0\" x2=\"0\" y2=\"7\" "
    "class=\"hatch\"/></pattern></defs>\n";

std::string ring_path(const nav::Ring& ring, const View& view) {
  std::string path;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    append_point(path, i == 0 ? 'M' : 'L', view.px(nav::to_m(ring[i])));
  }
  return path.empty() ? path : path + "Z";
}

// 1, 2 or 5 times a power of ten, about a sixth of the map's width.
double scale_length_m(const View& view) {
  const double wanted_m = view.width() / 6 / view.px_per_m();
  const double power = std::pow(10.0, std::floor(std::log10(wanted_m)));
  return wanted_m >= 5 * power ? 5 * power : wanted_m >= 2 * power ? 2 * power : power;
}

std::string scale_and_north(const View& view) {
  const double y = view.height() - 16, length_m = scale_length_m(view);
  const double right = kMargin_px + length_m * view.px_per_m();
  const double north = view.width() - kMargin_px - 10;
  return fmt::format(
      "<path d=\"M{0} {1:.1f}v6H{2:.1f}v-6\" class=\"scale\"/><text x=\"{3:.1f}\" "
      "y=\"{4:.1f}\">{5} "
      "m</text>\n<path d=\"M{6:.1f} {7:.1f}l6 20l-6 -5l-6 5Z\" class=\"needle\"/><text "
      "x=\"{6:.1f}\" "
      "y=\"{8:.1f}\" text-anchor=\"middle\">N</text>\n",
      kMargin_px, y - 6, right, right + 8, y + 3, length_m, north, y - 22, y + 12);
}

// The rules with every var(--name) replaced by the palette's value: not every viewer knows them.
std::string resolved(std::string rules) {
  constexpr std::string_view kVar = "var(";
  for (std::size_t at = rules.find(kVar); at != std::string::npos; at = rules.find(kVar, at)) {
    const std::size_t end = rules.find(')', at);
    const std::string name = rules.substr(at + kVar.size(), end - at - kVar.size()) + ": ";
    const std::size_t value = palette().find(name) + name.size();
    rules.replace(at, end + 1 - at, palette().substr(value, palette().find(';', value) - value));
  }
  return rules;
}

// Items in columns as wide as the widest needs; returns the height in pixels.
double legend_svg(const Legend& legend, double width_px, double top_px, std::string& out) {
  std::size_t longest = 1;
  for (const LegendItem& item : legend) longest = std::max(longest, item.words.size());
  const double column_px = kLegendSign_px + kCharacter_px * static_cast<double>(longest) + 14;
  const double room_px = width_px - 2 * kMargin_px;
  const auto columns = static_cast<std::size_t>(std::max(1.0, std::floor(room_px / column_px)));
  const std::size_t rows = (legend.size() + columns - 1) / columns;
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const double x =
        kMargin_px + static_cast<double>(i / std::max<std::size_t>(rows, 1)) * column_px;
    const double y =
        top_px + static_cast<double>(i % std::max<std::size_t>(rows, 1)) * kLegendRow_px;
    out += fmt::format(
        "<g transform=\"translate({:.1f} {:.1f})\">{}<text x=\"{}\" y=\"13.5\" "
        "class=\"words\">{}</text></g>\n",
        x, y, legend[i].svg, kLegendSign_px, legend[i].words);
  }
  return static_cast<double>(rows) * kLegendRow_px;
}

constexpr std::string_view kDocumentRules = R"(
svg { font-family: system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif; }
svg text { fill: var(--ink); font-size: 12px; }
svg .words { font-size: 13px; }
svg .head { font-size: 19px; font-weight: 650; }
svg .sub { fill: var(--soft); font-size: 13px; }
.paper { fill: var(--card); }
)";

}  // namespace

View::View(const Vector2d& low_m, const Vector2d& high_m) : low_m_(low_m), high_m_(high_m) {
  const Vector2d size_m = (high_m - low_m).cwiseMax(1e-3);
  scale_ = std::min((kWidthMax_px - 2 * kMargin_px) / size_m.x(),
                    (kHeightMax_px - 2 * kMargin_px) / size_m.y());
  width_ = std::max(size_m.x() * scale_ + 2 * kMargin_px, 360.0);
  height_ = size_m.y() * scale_ + 2 * kMargin_px + kFoot_px;
}

Vector2d View::px(const Vector2d& at_m) const {
  return {(width_ - (high_m_ - low_m_).x() * scale_) / 2 + (at_m.x() - low_m_.x()) * scale_,
          kMargin_px + (high_m_.y() - at_m.y()) * scale_};
}

void Box::add(const Vector2d& at_m) {
  low_ = low_.cwiseMin(at_m);
  high_ = high_.cwiseMax(at_m);
}

void Box::add(const nav::Polygons& polygons) {
  for (const auto& polygon : polygons) {
    for (const auto& point : polygon.outer) add(nav::to_m(point));
  }
}

void append_point(std::string& path, char command, const Vector2d& px) {
  fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", command, px.x(), px.y());
}

std::string polygons_path(const nav::Polygons& polygons, const View& view) {
  std::string path;
  for (const auto& polygon : polygons) {
    path += ring_path(polygon.outer, view);
    for (const auto& hole : polygon.holes) path += ring_path(hole, view);
  }
  return path;
}

std::string line_path(const std::vector<Vector2d>& line_m, const View& view) {
  std::string path;
  Vector2d last_px(0, 0);
  for (std::size_t i = 0; i < line_m.size(); ++i) {
    const Vector2d px = view.px(line_m[i]);
    if (i > 0 && i + 1 < line_m.size() && (px - last_px).norm() < 1) continue;
    append_point(path, i == 0 ? 'M' : 'L', px);
    last_px = px;
  }
  return path;
}

std::string drawn(const std::string& path, std::string_view css_class, const std::string& tip) {
  if (path.empty()) return "";
  const std::string title = tip.empty() ? "" : html::element("title", tip);
  return fmt::format("<path d=\"{}\" class=\"{}\" fill-rule=\"evenodd\">{}</path>\n", path,
                     css_class, title);
}

std::string outlines(const nav::SiteMap& map, const View& view) {
  return drawn(polygons_path(map.obstacles, view), "solid") +
         drawn(polygons_path(map.keep_out, view), "keep-out", "keep-out") +
         drawn(polygons_path(map.boundary, view), "boundary");
}

LegendItem legend_line(std::string_view css_class, const std::string& words) {
  return {fmt::format("<path d=\"M2 9H28\" class=\"{}\"/>", css_class), words};
}

LegendItem legend_area(std::string_view css_class, const std::string& words) {
  return {fmt::format("<rect x=\"2\" y=\"2\" width=\"26\" height=\"14\" class=\"{}\"/>", css_class),
          words};
}

std::string legend_html(const Legend& legend) {
  std::string out = "<ul class=\"legend\">\n";
  for (const LegendItem& item : legend)
    out += "<li><svg viewBox=\"0 0 30 18\">" + item.svg + "</svg>" + item.words + "</li>\n";
  return out + "</ul>\n";
}

std::string figure(const View& view, const std::string& label, const std::string& body) {
  return fmt::format(
             "<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" style=\"max-width: {0:.0f}px\" role=\"img\" "
             "aria-label=\"{2}\">\n",
             view.width(), view.height(), escaped(label)) +
         std::string(kHatch) + body + scale_and_north(view) + "</svg>\n";
}

std::string document(const View& view, const Picture& picture) {
  std::string legend;
  const double legend_px =
      legend_svg(picture.legend, view.width(), kHead_px + view.height(), legend);
  const double height_px = kHead_px + view.height() + legend_px + kMargin_px;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" role=\"img\">\n",
      view.width(), height_px);
  out += html::element("title", escaped(picture.title)) + "\n";
  out += html::element("style", resolved(std::string(kDocumentRules) + std::string(rules()) +
                                         picture.rules)) +
         "\n";
  out += std::string(kHatch) + "<rect width=\"100%\" height=\"100%\" class=\"paper\"/>\n";
  out += fmt::format("<text x=\"{}\" y=\"28\" class=\"head\">{}</text>\n", kMargin_px,
                     escaped(picture.title));
  out += fmt::format("<text x=\"{}\" y=\"48\" class=\"sub\">{}</text>\n", kMargin_px,
                     escaped(picture.subtitle));
  out += fmt::format("<g transform=\"translate(0 {})\">\n", kHead_px) + picture.body +
         scale_and_north(view) + "</g>\n";
  return out + legend + "</svg>\n";
}

// Colours that stay apart for the colour-blind: covered blue, uncovered orange, driven green.
std::string_view palette() {
  return R"(  --page: #f6f7f9; --card: #ffffff; --ink: #1b2430; --soft: #5c6876; --line: #dde2e8;
  --covered: #0b6fb8; --missed: #d9480f; --other: #8b95a1; --solid: #cfd5dc; --road: #a9a3c2;
  --driven: #12805c; --view: #a3268f; --badge: #243244; --badge-ink: #ffffff;
  --good: #12805c; --warn: #b45309; --alarm: #fdecea;
  --r0: #5b8def; --r1: #e0a526; --r2: #4fae74; --r3: #b678d8; --r4: #e0736b; --r5: #3fb3c4;)";
}

std::string_view rules() {
  return R"(
.boundary { fill: none; stroke: var(--other); stroke-width: 1; stroke-dasharray: 7 4; }
.solid { fill: var(--solid); }
.hatch { stroke: var(--missed); stroke-width: 1.4; stroke-opacity: 0.65; }
.keep-out { fill: url(#hatch); stroke: var(--missed); stroke-opacity: 0.65; stroke-width: 0.8; }
.free { fill-opacity: 0.16; stroke: none; }
.unplanned { fill: var(--other); fill-opacity: 0.1; }
.f0 { fill: var(--r0); } .f1 { fill: var(--r1); } .f2 { fill: var(--r2); }
.f3 { fill: var(--r3); } .f4 { fill: var(--r4); } .f5 { fill: var(--r5); }
.road { fill: none; stroke: var(--road); stroke-width: 0.9; }
.driven { fill: none; stroke: var(--driven); stroke-width: 1.9; stroke-linejoin: round; }
.tour { fill: none; stroke: var(--driven); stroke-width: 1.4; stroke-dasharray: 5 4; }
.other { fill: none; stroke: var(--other); stroke-width: 1.3; }
.covered { fill: none; stroke: var(--covered); stroke-width: 2.8; }
.missed { fill: none; stroke: var(--missed); stroke-width: 3.8; }
.leader { stroke: var(--ink); stroke-width: 0.9; }
.at { fill: var(--ink); }
.station { fill: var(--badge); stroke: var(--card); stroke-width: 1.2; }
.nbv { fill: var(--view); stroke: var(--card); stroke-width: 1.2; }
svg .mark { fill: var(--badge-ink); font-size: 10.5px; font-weight: 700; text-anchor: middle; }
.drop { fill: var(--card); stroke: var(--missed); stroke-width: 1.6; }
.cross { stroke: var(--missed); stroke-width: 1.8; fill: none; }
.start { fill: var(--driven); stroke: var(--card); stroke-width: 1.2; }
.scale { fill: none; stroke: var(--ink); stroke-width: 1.6; }
.needle { fill: var(--ink); }
)";
}

}  // namespace mission::drawing
