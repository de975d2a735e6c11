#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mission/progress.hpp"
#include "mission/report_html.hpp"
#include "mission/report_parts.hpp"

namespace mission::report {
namespace {

// The plot area of one chart, in the SVG's own pixels.
constexpr double kWidth = 560, kHeight = 230, kLeft = 62, kRight = 16, kTop = 34, kBottom = 36;

// The step that gives at most `ticks` ticks up to `most`: 1, 2 or 5 times a power of ten.
double tick_step(double most, int ticks) {
  const double rough = std::max(most, 1e-9) / ticks;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

// One chart over the scans; y linear from 0, or logarithmic from 1 (0 is drawn at the bottom).
class Chart {
 public:
  Chart(const RunRecord& run, double y_most, bool logarithmic)
      : scans_(std::max<std::size_t>(run.scans.size(), 1)), logarithmic_(logarithmic) {
    step_ = tick_step(y_most, 4);
    top_ = logarithmic ? std::max(1.0, std::ceil(std::log10(std::max(y_most, 1.0)) - 1e-9))
                       : step_ * std::max(1.0, std::ceil(y_most / step_ - 1e-9));
    shade_views(run);
  }

  double x(std::size_t scan) const {
    return kLeft + (static_cast<double>(scan) + 0.5) * plot_width() / static_cast<double>(scans_);
  }
  double y(double value) const {
    const double up = logarithmic_ ? std::log10(std::max(value, 1.0)) : value;
    return kHeight - kBottom - std::clamp(up / top_, 0.0, 1.0) * (kHeight - kTop - kBottom);
  }

  void add(const std::string& svg) { body_ += svg; }
  void text(double at_x, double at_y, std::string_view css_class, std::string_view anchor,
            std::string_view words) {
    body_ +=
        fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"{}\" text-anchor=\"{}\">{}</text>\n",
                    at_x, at_y, css_class, anchor, words);
  }
  void line(const std::vector<double>& values, std::string_view css_class) {
    std::string points;
    for (std::size_t i = 0; i < values.size(); ++i) {
      points += fmt::format("{:.1f},{:.1f} ", x(i), y(values[i]));
    }
    body_ += fmt::format("<polyline points=\"{}\" class=\"{}\"/>\n", points, css_class);
  }
  void dot(std::size_t scan, double value, std::string_view css_class, std::string_view tip) {
    body_ += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.4\" class=\"{}\"><title>{}</title></circle>\n",
        x(scan), y(value), css_class, tip);
  }

  std::string svg(std::string_view title) {
    text(kLeft, 16, "title", "start", title);
    text((kLeft + kWidth - kRight) / 2, kHeight - 4, "tick", "middle", "scan");
    return fmt::format(
               "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
               kWidth, kHeight, title) +
           axes() + body_ + "</svg>\n";
  }

 private:
  double plot_width() const { return kWidth - kLeft - kRight; }

  void shade_views(const RunRecord& run) {
    const double half = plot_width() / static_cast<double>(scans_) / 2;
    for (std::size_t i = 0; i < run.scans.size(); ++i) {
      if (!run.scans[i].next_best_view) continue;
      body_ += fmt::format(
          "<rect x=\"{:.2f}\" y=\"{}\" width=\"{:.2f}\" height=\"{}\" class=\"v-zone\"/>\n",
          x(i) - half, kTop, 2 * half, kHeight - kTop - kBottom);
    }
  }

  std::string y_tick(double value) const {
    return fmt::format(
        "<line x1=\"{}\" y1=\"{:.1f}\" x2=\"{}\" y2=\"{:.1f}\" class=\"grid\"/><text x=\"{}\" "
        "y=\"{:.1f}\" class=\"tick\" text-anchor=\"end\">{}</text>\n",
        kLeft, y(value), kWidth - kRight, y(value), kLeft - 7, y(value) + 4,
        html::number(value, decimals()));
  }

  // So many that neighbouring ticks read differently.
  int decimals() const {
    return logarithmic_ ? 0 : std::max(0, -static_cast<int>(std::floor(std::log10(step_) + 1e-9)));
  }

  std::string axes() const {
    std::string out;
    if (logarithmic_) {
      for (int power = 0; power <= static_cast<int>(top_); ++power) {
        out += y_tick(std::pow(10.0, power));
      }
    } else {
      const int ticks = static_cast<int>(std::lround(top_ / step_));
      for (int i = 0; i <= ticks; ++i) out += y_tick(i * step_);
    }
    const auto every =
        static_cast<std::size_t>(std::max(1.0, tick_step(static_cast<double>(scans_), 16)));
    for (std::size_t scan = every; scan <= scans_; scan += every) {
      out += fmt::format(
          "<text x=\"{:.1f}\" y=\"{}\" class=\"tick\" text-anchor=\"middle\">{}</text>\n",
          x(scan - 1), kHeight - kBottom + 16, scan);
    }
    return out + fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" class=\"axis\"/>\n",
                             kLeft, kHeight - kBottom, kWidth - kRight, kHeight - kBottom);
  }

  std::size_t scans_;
  bool logarithmic_;
  double step_{}, top_{};
  std::string body_;
};

std::string totals_chart(const RunRecord& run) {
  std::vector<double> occupied, boundary;
  for (const ScanRecord& scan : run.scans) {
    occupied.push_back(static_cast<double>(scan.after.seen_occupied));
    boundary.push_back(static_cast<double>(scan.after.boundary_unseen));
  }
  const double most = std::max(*std::max_element(occupied.begin(), occupied.end()),
                               *std::max_element(boundary.begin(), boundary.end()));
  Chart chart(run, most, false);
  chart.line(occupied, "c-line");
  chart.line(boundary, "m-line");
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const std::string name = html::escaped(run.scans[i].name);
    chart.dot(i, occupied[i], "c-dot",
              name + ": " + html::number(occupied[i], 0) + " seen-occupied");
    chart.dot(i, boundary[i], "m-dot",
              name + ": " + html::number(boundary[i], 0) + " boundary unseen");
  }
  chart.text(kWidth - kRight, 16, "c-text", "end",
             "seen-occupied <tspan class=\"m-text\" dx=\"8\">boundary unseen</tspan>");
  return chart.svg("Voxels after each scan");
}

std::string gains_chart(const RunRecord& run) {
  std::vector<double> gains;
  double most = run.gain_min_voxels;
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    gains.push_back(static_cast<double>(occupied_gained(run, i)));
    most = std::max({most, gains[i], static_cast<double>(run.scans[i].predicted_voxels)});
  }
  Chart chart(run, most, true);
  const double limit = chart.y(run.gain_min_voxels);
  chart.add(fmt::format("<line x1=\"{}\" y1=\"{:.1f}\" x2=\"{}\" y2=\"{:.1f}\" class=\"limit\"/>\n",
                        kLeft, limit, kWidth - kRight, limit));
  chart.line(gains, "c-line");
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const ScanRecord& scan = run.scans[i];
    const std::string name = html::escaped(scan.name);
    chart.dot(i, gains[i], "c-dot", name + ": " + html::number(gains[i], 0) + " gained");
    if (!scan.next_best_view) continue;
    chart.dot(i, static_cast<double>(scan.predicted_voxels), "v-ring",
              name + ": " + count_text(scan.predicted_voxels) + " predicted");
    chart.dot(i, static_cast<double>(scan.resolved_voxels), "v-dot",
              name + ": " + count_text(scan.resolved_voxels) + " of them resolved");
  }
  return chart.svg("Voxels gained per scan (logarithmic)");
}

}  // namespace

std::string voxel_curves(const RunRecord& run) {
  if (run.scans.empty()) return "";
  constexpr std::string_view kKey =
      "<ul class=\"legend\"><li><svg viewBox=\"0 0 30 18\"><line x1=\"2\" y1=\"9\" x2=\"28\" "
      "y2=\"9\" class=\"c-line\"/><circle cx=\"15\" cy=\"9\" r=\"3.4\" class=\"c-dot\"/>"
      "</svg>newly seen-occupied</li><li><svg viewBox=\"0 0 30 18\"><circle cx=\"15\" cy=\"9\" "
      "r=\"4\" class=\"v-ring\"/></svg>predicted for the NBV</li><li><svg viewBox=\"0 0 30 18\">"
      "<circle cx=\"15\" cy=\"9\" r=\"4\" class=\"v-dot\"/></svg>resolved by it</li><li><svg "
      "viewBox=\"0 0 30 18\"><rect x=\"3\" y=\"2\" width=\"24\" height=\"14\" class=\"v-zone\"/>"
      "</svg>Phase II</li><li><svg viewBox=\"0 0 30 18\"><line x1=\"2\" y1=\"9\" x2=\"28\" "
      "y2=\"9\" class=\"limit\"/></svg>least worth a view</li></ul>\n";
  return totals_chart(run) + gains_chart(run) + std::string(kKey);
}

std::string pose_error_chart(const RunRecord& run) {
  double most = 0;
  for (const ScanRecord& scan : run.scans) {
    if (const auto error = pose_error(scan)) {
      most = std::max({most, error->position_m, 3 * scan.sigma_position_m});
    }
  }
  if (most <= 0) return "";
  Chart chart(run, most, false);
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const auto error = pose_error(run.scans[i]);
    if (!error) continue;
    chart.add(fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"claim\"/>\n",
        chart.x(i), chart.y(0), chart.x(i), chart.y(3 * run.scans[i].sigma_position_m)));
    chart.dot(i, error->position_m, "m-dot",
              html::escaped(run.scans[i].name) + ": " + html::number(error->position_m, 3) + " m");
  }
  chart.text(kWidth - kRight, 16, "m-text", "end",
             "error <tspan class=\"c-text\" dx=\"8\">claimed 3 sigma</tspan>");
  return chart.svg("Position error per scan, m");
}

}  // namespace mission::report
