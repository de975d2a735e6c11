#include "drivers/ouster_api.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value.hpp>

#include "drivers/text.hpp"

namespace drivers {
namespace {

namespace json = boost::json;

constexpr std::size_t kTextMax = 200, kAlertsMax = 64;

// The object that a text is, or what is wrong with it.
std::string read_object(std::string_view text, json::value& into) {
  json::error_code error;
  into = json::parse(json::string_view(text.data(), text.size()), error);
  if (error) return "no JSON: " + error.message();
  return into.is_object() ? "" : "must be an object";
}

std::string member_text(const json::object& object, std::string_view key) {
  const json::value* value = object.if_contains(json::string_view(key.data(), key.size()));
  const json::string* text = value != nullptr ? value->if_string() : nullptr;
  return text != nullptr ? std::string(text->data(), std::min(text->size(), kTextMax))
                         : std::string();
}

}  // namespace

std::string parse_ouster_settings(std::string_view text, OusterSettings& into) {
  json::value root;
  if (std::string problem = read_object(text, root); !problem.empty()) return problem;
  const json::object& object = root.get_object();
  into = {};
  into.udp_dest = member_text(object, "udp_dest");
  if (into.udp_dest.empty()) into.udp_dest = member_text(object, "udp_ip");  // As once named.
  into.operating_mode = member_text(object, "operating_mode");
  if (const json::value* port = object.if_contains("udp_port_lidar")) {
    json::error_code error;
    const auto number = port->to_number<std::uint16_t>(error);
    if (error) return "udp_port_lidar must be a port";
    into.udp_port_lidar = number;
  }
  return {};
}

std::string parse_ouster_alerts(std::string_view text, std::vector<OusterAlert>& into) {
  into.clear();
  json::value root;
  if (std::string problem = read_object(text, root); !problem.empty()) return problem;
  const json::value* active = root.get_object().if_contains("active");
  const json::array* all = active != nullptr ? active->if_array() : nullptr;
  if (all == nullptr) return "\"active\" must be a list";
  for (const json::value& each : *all) {
    const json::object* alert = each.if_object();
    if (alert == nullptr) return "an alert must be an object";
    if (into.size() < kAlertsMax)
      into.push_back({member_text(*alert, "id"), member_text(*alert, "level"),
                      member_text(*alert, "category"), member_text(*alert, "msg")});
  }
  return {};
}

std::optional<OusterVersion> ouster_version(std::string_view text) {
  if (text.starts_with('v')) text.remove_prefix(1);
  text = text.substr(0, text.find_first_of("-+ "));
  OusterVersion version{};
  for (int& part : version) {
    const auto number = whole_number<int>(take_field(text, '.'));
    if (!number || *number < 0) return std::nullopt;
    part = *number;
  }
  return version;
}

std::string ouster_settings_json(const OusterSettings& settings) {
  json::object object{{"udp_dest", settings.udp_dest}, {"operating_mode", settings.operating_mode}};
  if (settings.udp_port_lidar) object["udp_port_lidar"] = *settings.udp_port_lidar;
  return json::serialize(object);
}

std::string ouster_alerts_json(const std::vector<OusterAlert>& alerts) {
  json::array active;
  for (const OusterAlert& alert : alerts)
    active.push_back(json::object{{"id", alert.id},
                                  {"level", alert.level},
                                  {"category", alert.category},
                                  {"msg", alert.text},
                                  {"active", true}});
  const json::object all{{"active", active}, {"log", json::array()}, {"next_cursor", 0}};
  return json::serialize(all);
}

}  // namespace drivers
