#include "drivers/cia402_layout.hpp"

#include <algorithm>

namespace drivers::cia402 {
namespace {

using canopen::Mapped;
using Mapping = std::vector<Mapped>;

constexpr std::size_t kEntriesMax = 8;
constexpr std::uint16_t kPaddingLast = 0x0007;  // Data types stand for objects that nobody has.

bool has(const Mapping& mapping, const Mapped& wanted) {
  return std::ranges::any_of(mapping, [&](const Mapped& each) {
    return each.at == wanted.at && each.bits == wanted.bits;
  });
}

bool may_be_written(const Mapping& mapping, const Mapped& target) {
  return std::ranges::all_of(mapping, [&](const Mapped& each) {
    return each.at == kControlword || each.at == target.at || each.at == kModes ||
           each.at.index <= kPaddingLast;
  });
}

// The first PDO for which `fits`, with signs where they belong.
template <class Fits>
bool find(const std::array<Mapping, 4>& pdos, Fits fits, PdoLayout::Part& into) {
  for (std::size_t i = 0; i < pdos.size(); ++i) {
    if (!canopen::is_valid(pdos[i]) || !fits(pdos[i])) continue;
    into = {static_cast<std::uint8_t>(i + 1), pdos[i]};
    for (Mapped& each : into.mapping)
      each.is_signed = each.at != kControlword && each.at != kStatusword;
    return true;
  }
  return false;
}

}  // namespace

PdoLayout own_layout(Mode mode) {
  const VelocityObjects objects = velocity_objects(mode);
  return {{1, {{kControlword, 16, false}, objects.target}},
          {1, {{kStatusword, 16, false}, objects.actual}},
          {2, {{kPosition, 32, true}, {kTorqueActual, 16, true}}},
          false};
}

std::string find_layout(const FixedPdos& pdos, Mode mode, PdoLayout& into) {
  const VelocityObjects objects = velocity_objects(mode);
  const Mapped controlword{kControlword, 16, false}, statusword{kStatusword, 16, false},
      position{kPosition, 32, true};
  into.fixed = true;
  const auto commands = [&](const Mapping& m) {
    return has(m, controlword) && has(m, objects.target) && may_be_written(m, objects.target);
  };
  const auto tells_status = [&](const Mapping& m) {
    return has(m, statusword) && has(m, objects.actual);
  };
  const auto tells_position = [&](const Mapping& m) { return has(m, position); };
  std::string lacks;
  const auto need = [&](bool found, const char* what) {
    if (!found) lacks += (lacks.empty() ? "no " : ", no ") + std::string(what);
  };
  need(find(pdos.to_node, commands, into.target), "RPDO with controlword and target speed alone");
  need(find(pdos.from_node, tells_status, into.status), "TPDO with statusword and actual speed");
  need(find(pdos.from_node, tells_position, into.position), "TPDO with the position");
  return lacks;
}

bool is_mapping(canopen::Address at) {
  return (at.index >= 0x1600 && at.index < 0x1800) || (at.index >= 0x1A00 && at.index < 0x1C00);
}

std::optional<std::int64_t> value_in(std::span<const Mapped> mapping, const canopen::Pdo& pdo,
                                     canopen::Address at) {
  std::array<std::int64_t, kEntriesMax> values{};
  if (mapping.size() > values.size()) return std::nullopt;
  if (!canopen::unpack(mapping, pdo, std::span(values).first(mapping.size()))) return std::nullopt;
  for (std::size_t i = 0; i < mapping.size(); ++i)
    if (mapping[i].at == at) return values[i];
  return std::nullopt;
}

}  // namespace drivers::cia402
