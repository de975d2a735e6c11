#include "mission/geojson.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/json.hpp>
#include <cmath>
#include <map>

#include "mission/geojson_crs.hpp"
#include "mission/json_reader.hpp"
#include "mission/suggest.hpp"

namespace mission {
namespace {

namespace json = boost::json;
using nav::RawFeature;
using nav::Role;
using Metres = std::vector<Eigen::Vector2d>;

const std::vector<std::pair<std::string, Role>>& roles() {
  static const std::vector<std::pair<std::string, Role>> all{
      {"boundary", Role::boundary}, {"obstacle", Role::obstacle}, {"keep_out", Role::keep_out},
      {"target", Role::target},     {"region", Role::region},     {"start", Role::start}};
  return all;
}

std::vector<std::string> role_names() {
  std::vector<std::string> names;
  for (const auto& [name, role] : roles()) names.push_back(name);
  return names;
}

const std::vector<std::string>& geometry_types() {
  static const std::vector<std::string> all{"Polygon",           "MultiPolygon", "LineString",
                                            "MultiLineString",   "Point",        "MultiPoint",
                                            "GeometryCollection"};
  return all;
}

class GeoJsonReader : JsonReader {
 public:
  using JsonReader::JsonReader;

  GeoJsonSite run() {
    json::value root;
    if (parse(root)) {
      const Node top{root};
      if (const json::object* object = object_at(top, "the map")) {
        read_features(top, *object);
        read_site_members(top, *object);
        place_on_plane(top, *object);
      }
      say_near_misses();
    }
    out_.notes = notes_.taken();
    out_.errors = errors_.taken();
    return std::move(out_);
  }

 private:
  // --- Features -------------------------------------------------------------------------------

  std::string type_of(const Node& node, const json::object& object) {
    const json::value* type = object.if_contains("type");
    if (type && type->is_string()) return std::string(type->get_string());
    error(node, "\"type\" is missing; this is no GeoJSON");
    return "";
  }

  void read_features(const Node& top, const json::object& object) {
    const std::string type = type_of(top, object);
    if (type == "Feature") {
      read_feature(top, object, 0, places_.find({}));
    } else if (type == "FeatureCollection") {
      const json::value* features = object.if_contains("features");
      const Node node{features ? *features : top.value, &top, "features"};
      if (!features) {
        error(top, "\"features\" is missing");
      } else if (const json::array* array = array_at(node, "\"features\"")) {
        const std::vector<std::size_t> offsets = places_.elements(places_.find(path_to(node)));
        for (std::size_t i = 0; i < array->size(); ++i) {
          label_ = fmt::format("feature {}", i);
          const Node feature = node.element(i);
          if (const json::object* one = object_at(feature, "a feature")) {
            read_feature(feature, *one, i, offsets.at(i));
          }
        }
      }
    } else if (is_geometry(type)) {
      label_ = "feature 0";
      RawFeature raw;
      raw.role = Role::obstacle;
      raw.where = fmt::format("{} ({})", place(places_.find({})), label_);
      read_geometry(top, false, raw);
      keep(top, std::move(raw));
    } else if (!type.empty()) {
      std::vector<std::string> known = geometry_types();
      known.insert(known.begin(), {"FeatureCollection", "Feature"});
      error(top, fmt::format("\"type\" is '{}'{}; a map is one of {}", type,
                             did_you_mean(closest(type, known)), listed(known)));
    }
    label_.clear();
  }

  static bool is_geometry(const std::string& type) {
    const auto& all = geometry_types();
    return std::find(all.begin(), all.end(), type) != all.end();
  }

  void read_feature(const Node& node, const json::object& object, std::size_t index,
                    std::size_t offset) {
    const json::value nothing = json::object();
    const json::value* found = object.if_contains("properties");
    const Node properties{found && !found->is_null() ? *found : nothing, &node, "properties"};
    RawFeature raw;
    raw.name = name_of(properties.value);
    label_ = fmt::format("feature {}", index) +
             (raw.name.empty() ? "" : " '" + printable(raw.name) + "'");
    raw.where = fmt::format("{} ({})", place(offset), label_);
    const std::string type = type_of(node, object);
    if (type.empty()) return;
    if (type != "Feature") {
      error(node, fmt::format("\"type\" is '{}', but every element of \"features\" is a 'Feature'",
                              type));
      return;
    }
    const json::object* members = object_at(properties, "\"properties\"");
    if (!members) return;
    bool has_role = false;
    if (!read_role(properties, *members, raw, has_role)) return;
    read_properties(properties, *members, raw);
    const json::value* geometry = object.if_contains("geometry");
    if (geometry && !geometry->is_null()) {
      read_geometry({*geometry, &node, "geometry"}, has_role, raw);
    }
    keep(node, std::move(raw));
  }

  static std::string name_of(const json::value& properties) {
    const json::object* members = properties.if_object();
    const json::value* name = members ? members->if_contains("name") : nullptr;
    if (!name || name->is_null()) return "";
    return name->is_string() ? std::string(name->get_string()) : json::serialize(*name);
  }

  // Names come from outside: no line breaks or escape sequences in messages.
  static std::string printable(std::string name) {
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
    return name;
  }

  bool read_role(const Node& properties, const json::object& members, RawFeature& raw,
                 bool& has_role) {
    raw.role = Role::obstacle;
    const json::value* role = members.if_contains("role");
    has_role = role && !role->is_null();
    if (!has_role) return true;
    const Node node{*role, &properties, "role"};
    if (!role->is_string()) {
      error(node, fmt::format("\"role\" must be one of {}, not {}", listed(role_names()),
                              kind_name(*role)));
      return false;
    }
    for (const auto& [name, value] : roles()) {
      if (role->get_string() != name) continue;
      raw.role = value;
      return true;
    }
    const std::string typed(role->get_string());
    error(node, fmt::format("role '{}' is unknown{}; a role is one of {}", typed,
                            did_you_mean(closest(typed, role_names())), listed(role_names())));
    return false;
  }

  void read_properties(const Node& properties, const json::object& members, RawFeature& raw) {
    if (raw.role == Role::boundary || raw.role == Role::region) {
      raw.ground_z_m = number(properties, members, "ground_z_m");
    }
    if (raw.role == Role::start) raw.heading_deg = number(properties, members, "heading_deg");
    if (const json::value* wall = members.if_contains("wall"); wall && raw.role == Role::boundary) {
      if (wall->is_bool()) {
        raw.wall = wall->get_bool();
      } else {
        error({*wall, &properties, "wall"},
              fmt::format("\"wall\" must be true or false, not {}", kind_name(*wall)));
      }
    }
    note_near_misses(properties, members, {"role", "ground_z_m", "wall", "heading_deg"});
  }

  // Collects keys that are read nowhere but resemble one that is: a slip must not pass in silence.
  void note_near_misses(const Node& parent, const json::object& members,
                        const std::vector<std::string>& known) {
    for (const auto& member : members) {
      const std::string key(member.key());
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      auto [seen, fresh] = near_misses_.try_emplace(key);
      ++seen->second.count;
      if (!fresh) continue;
      const std::vector<std::string> meant = closest(key, known);
      if (meant.empty()) continue;
      seen->second.text = message({member.value(), &parent, key},
                                  fmt::format("\"{}\" is not read{}", key, did_you_mean(meant)));
    }
  }

  void say_near_misses() {
    for (const auto& [key, miss] : near_misses_) {
      if (miss.text.empty()) continue;
      const std::string more =
          miss.count > 1 ? fmt::format(" ({} features have it)", miss.count) : "";
      notes_.add(miss.text + more);
    }
  }

  void keep(const Node& node, RawFeature raw) {
    if (raw.polygons_m.empty() && raw.lines_m.empty() && !raw.point_m) {
      note(node, "has no shape to use; ignored");
    } else {
      out_.raw.features.push_back(std::move(raw));
    }
  }

  // --- Geometries -----------------------------------------------------------------------------

  void read_geometry(const Node& node, bool has_role, RawFeature& raw) {
    const json::object* object = object_at(node, "\"geometry\"");
    const std::string type = object ? type_of(node, *object) : "";
    if (type.empty()) return;
    const char* key = type == "GeometryCollection" ? "geometries" : "coordinates";
    if (!is_geometry(type)) {
      error(node,
            fmt::format("geometry type '{}' is unknown{}; it is one of {}", type,
                        did_you_mean(closest(type, geometry_types())), listed(geometry_types())));
      return;
    }
    const json::value* content = object->if_contains(key);
    if (!content) {
      error(node, fmt::format("\"{}\" is missing", key));
      return;
    }
    read_content({*content, &node, key}, type, has_role, raw);
  }

  void read_content(const Node& content, const std::string& type, bool has_role, RawFeature& raw) {
    const json::array* array = array_at(content, "coordinates");
    if (!array) return;
    if (type == "Polygon") return add_polygon(content, raw);
    if (type == "LineString") return add_line(content, raw);
    if (type == "Point") return add_point(content, has_role, raw);
    for (std::size_t i = 0; i < array->size(); ++i) {
      const Node part = content.element(i);
      if (type == "MultiPolygon") add_polygon(part, raw);
      if (type == "MultiLineString") add_line(part, raw);
      if (type == "MultiPoint") add_point(part, has_role, raw);
      if (type == "GeometryCollection") read_geometry(part, has_role, raw);
    }
  }

  void add_polygon(const Node& node, RawFeature& raw) {
    const json::array* rings = array_at(node, "a polygon");
    if (!rings || rings->empty()) return;
    if (raw.role == Role::start) return error(node, "a start is drawn as a polygon; draw a Point");
    std::vector<Metres> polygon;
    for (std::size_t i = 0; i < rings->size(); ++i) {
      const std::optional<Metres> ring = positions(node.element(i), "a ring");
      if (!ring) return;
      polygon.push_back(*ring);
    }
    raw.polygons_m.push_back(std::move(polygon));
  }

  void add_line(const Node& node, RawFeature& raw) {
    const std::optional<Metres> line = positions(node, "a line");
    if (!line || line->empty()) return;
    if (raw.role == Role::start) return error(node, "a start is drawn as a line; draw a Point");
    if (raw.role == Role::obstacle || raw.role == Role::target) {
      raw.lines_m.push_back(*line);
    } else if (line->size() >= 4 && line->front() == line->back()) {
      note(node, "is a closed line; taken as the outline of a polygon");
      raw.polygons_m.push_back({*line});
    } else {
      error(node, "is an open line, but this role needs an area; draw a Polygon");
    }
  }

  void add_point(const Node& node, bool has_role, RawFeature& raw) {
    const std::optional<Eigen::Vector2d> point = position(node);
    if (!point) return;
    if (!has_role) return note(node, "is a point without a role; ignored");
    if (raw.role != Role::start) return error(node, "is a point, but only a start is one");
    if (raw.point_m) return error(node, "a start has one point");
    raw.point_m = point;
  }

  std::optional<Metres> positions(const Node& node, const char* what) {
    const json::array* array = array_at(node, what);
    if (!array) return std::nullopt;
    Metres all;
    for (std::size_t i = 0; i < array->size(); ++i) {
      const std::optional<Eigen::Vector2d> one = position(node.element(i));
      if (!one) return std::nullopt;
      all.push_back(*one);
    }
    return all;
  }

  // Further numbers (a height) are ignored.
  std::optional<Eigen::Vector2d> position(const Node& node) {
    const json::array* array = array_at(node, "a position");
    if (!array) return std::nullopt;
    if (array->size() < 2) {
      error(node, fmt::format("a position needs two numbers [x, y], this has {}", array->size()));
      return std::nullopt;
    }
    Eigen::Vector2d point;
    for (std::size_t i = 0; i < 2; ++i) {
      const json::value& value = (*array)[i];
      if (!value.is_number()) {
        error(node.element(i),
              fmt::format("a coordinate must be a number, not {}{}", kind_name(value),
                          value.is_array() ? " (one bracket too many?)" : ""));
        return std::nullopt;
      }
      boost::system::error_code code;
      point[static_cast<Eigen::Index>(i)] = value.to_number<double>(code);
    }
    return point;
  }

  // --- The site -------------------------------------------------------------------------------

  void read_site_members(const Node& top, const json::object& object) {
    out_.raw.ground_z_m = number(top, object, "ground_z_m");
    if (object.contains("features")) {
      note_near_misses(top, object, {"crs", "origin", "ground_z_m", "type", "features", "name"});
    }
  }

  // The crs member: a name, or the object {"type": "name", "properties": {"name": ...}} that
  // programs write.
  std::optional<Crs> read_crs(const Node& top, const json::object& object, bool& wrong) {
    const json::value* crs = object.if_contains("crs");
    if (!crs || crs->is_null()) return std::nullopt;
    const json::value* name = crs;
    if (crs->is_object()) {
      boost::system::error_code code;
      name = crs->find_pointer("/properties/name", code);
    }
    const bool is_text = name && name->is_string();
    const std::string typed = is_text ? std::string(name->get_string()) : json::serialize(*crs);
    const std::optional<Crs> known = is_text ? crs_named(typed) : std::nullopt;
    wrong = !known;
    if (wrong) {
      error({*crs, &top, "crs"},
            fmt::format(
                "\"crs\" {} is unknown; write \"local\" for metres or \"WGS84\" for longitude "
                "and latitude (ogr2ogr -t_srs EPSG:4326 converts other systems)",
                typed));
    }
    return known;
  }

  std::optional<GeoOrigin> read_origin(const Node& top, const json::object& object, bool& wrong) {
    const json::value* value = object.if_contains("origin");
    if (!value || value->is_null()) return std::nullopt;
    const Node node{*value, &top, "origin"};
    const std::size_t errors_before = errors_.count();
    std::optional<GeoOrigin> origin;
    if (const json::object* members = object_at(node, "\"origin\"")) {
      const auto lon = number(node, *members, "lon");
      const auto lat = number(node, *members, "lat");
      const auto h = number(node, *members, "h");
      if (!lon || !lat || std::abs(*lon) > 180 || std::abs(*lat) > 90) {
        error(node,
              "\"origin\" needs \"lon\" (-180 to 180) and \"lat\" (-90 to 90) in degrees, and "
              "may have \"h\" in metres");
      } else {
        origin = GeoOrigin{*lon, *lat, h.value_or(0)};
      }
    }
    wrong = errors_.count() > errors_before;
    return origin;
  }

  void place_on_plane(const Node& top, const json::object& object) {
    bool wrong_crs = false;
    bool wrong_origin = false;
    const std::optional<Crs> crs = read_crs(top, object, wrong_crs);
    std::optional<GeoOrigin> origin = read_origin(top, object, wrong_origin);
    if (wrong_crs || wrong_origin) return;
    out_.origin = origin;
    if (crs == Crs::local) return;
    if (!crs && !looks_like_degrees(out_.raw)) return;
    if (!crs) {
      note(top,
           "the coordinates are less than 1 unit apart and could be degrees: taken as WGS84 "
           "longitude and latitude; write \"crs\": \"WGS84\" (or \"local\") to be sure");
    }
    const std::optional<Eigen::Vector2d> first = first_position(out_.raw);
    if (!origin && first) {
      origin = GeoOrigin{first->x(), first->y(), 0};
      note(top,
           fmt::format("the map names no \"origin\": its first vertex, lon {} lat {}, is (0, 0)",
                       first->x(), first->y()));
    }
    if (!origin) return;
    out_.origin = origin;
    for (const std::string& off : to_local(out_.raw, *origin)) errors_.add(off);
  }

  struct NearMiss {
    std::string text;  // Empty: resembles nothing.
    int count = 0;
  };

  GeoJsonSite out_;
  std::map<std::string, NearMiss> near_misses_;
};

}  // namespace

GeoJsonSite read_geojson(std::string_view text, const std::string& file_name) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return GeoJsonReader(text, file_name).run();
}

}  // namespace mission
