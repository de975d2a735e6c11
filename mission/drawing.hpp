// Drawing maps as SVG: what every picture of a site has in common. Pure.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "nav/geometry.hpp"
#include "nav/site_map.hpp"

namespace mission::drawing {

// From metres in W (y up) to the SVG's pixels (y down).
class View {
 public:
  View(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m);

  Eigen::Vector2d px(const Eigen::Vector2d& at_m) const;
  double width() const { return width_; }
  double height() const { return height_; }
  double px_per_m() const { return scale_; }

 private:
  Eigen::Vector2d low_m_, high_m_;
  double scale_{}, width_{}, height_{};
};

// Grows to hold what is to be drawn.
class Box {
 public:
  void add(const Eigen::Vector2d& at_m);
  void add(const nav::Polygons& polygons);
  bool empty() const { return low_.x() > high_.x(); }
  View view() const {
    if (empty()) return {{0, 0}, {1, 1}};
    return {low_, high_};
  }

 private:
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high_ = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
};

// Paths for <path d="...">.
void append_point(std::string& path, char command, const Eigen::Vector2d& px);
std::string polygons_path(const nav::Polygons& polygons, const View& view);
// Points closer than a pixel to the last one drawn are left out, the last one stays.
std::string line_path(const std::vector<Eigen::Vector2d>& line_m, const View& view);

// The path as an element; nothing for an empty path. `tip` (HTML) shows under the mouse.
std::string drawn(const std::string& path, std::string_view css_class, const std::string& tip = {});

// Obstacles, keep-outs and boundary.
std::string outlines(const nav::SiteMap& map, const View& view);

struct LegendItem {
  std::string svg;    // Fits 30 x 18 pixels.
  std::string words;  // HTML.
};
using Legend = std::vector<LegendItem>;

LegendItem legend_line(std::string_view css_class, const std::string& words);
LegendItem legend_area(std::string_view css_class, const std::string& words);
std::string legend_html(const Legend& legend);

// The map as an element of a page: body, scale bar and north; the page has style() and the legend.
std::string figure(const View& view, const std::string& label, const std::string& body);

// The map as a file of its own, legend and style inside, for any viewer (no CSS variables).
struct Picture {
  std::string title;     // Text.
  std::string subtitle;  // Text; may be empty.
  std::string body;      // In the view's pixels.
  Legend legend;
  std::string rules;  // CSS beside rules(); may use the palette's variables.
};
std::string document(const View& view, const Picture& picture);

// CSS: the light palette's variables ("--name: #rrggbb; ..."), and what the classes look like.
std::string_view palette();
std::string_view rules();

}  // namespace mission::drawing
