#include "drivers/ublox_startup.hpp"

#include <algorithm>

#include "drivers/text.hpp"
#include "drivers/ubx_encode.hpp"

namespace drivers {
namespace {

constexpr std::uint32_t kUsbAfterUart1 = 2;  // Of the keys of messages.
constexpr std::uint8_t kCfg = 0x06;

// The value after a name: "PROTVER=27.31", "PROTVER 15.00".
std::string after(const std::vector<std::string>& extensions, std::string_view name) {
  for (const std::string& line : extensions)
    if (line.starts_with(name) && line.size() > name.size() &&
        (line[name.size()] == '=' || line[name.size()] == ' '))
      return line.substr(name.size() + 1);
  return {};
}

std::vector<UbxSetting> f9_messages(const UbloxSettings& s) {
  using namespace ubx_key;
  const std::uint32_t port = s.port == UbloxPort::usb ? kUsbAfterUart1 : 0;
  std::vector<UbxSetting> settings;
  for (const std::uint32_t key : {kNavPvtUart1, kNavHpposllhUart1, kNavCovUart1, kNavEoeUart1})
    settings.push_back({key + port, 1});
  settings.push_back({kMonRfUart1 + port, static_cast<std::uint64_t>(s.rate_hz)});
  settings.push_back({kRxmRtcmUart1 + port, s.corrections ? 1U : 0U});
  return settings;
}

UbloxStep valset(std::string_view purpose, const std::vector<UbxSetting>& settings) {
  return {purpose, *ubx_valset(static_cast<std::uint8_t>(UbxLayer::ram), settings), kCfg, 0x8A, {},
          {}};
}

std::vector<UbloxStep> f9_steps(const UbloxSettings& s) {
  using namespace ubx_key;
  const bool usb = s.port == UbloxPort::usb;
  const std::vector<UbxSetting> protocols{{usb ? kUsbOutNmea : kUart1OutNmea, 0},
                                          {usb ? kUsbInRtcm3 : kUart1InRtcm3, s.corrections}};
  const std::vector<UbxSetting> rate{{kRateMeas_ms, static_cast<std::uint64_t>(1000 / s.rate_hz)},
                                     {kRateNav, 1}};
  const std::vector<UbxSetting> motion{{kDynamicModel, s.dynamic_model}};
  const std::vector<UbxSetting> messages = f9_messages(s);
  std::vector<UbloxStep> steps{
      valset("choose the protocols", protocols), valset("set the rate", rate),
      valset("set the dynamic model", motion), valset("choose the messages", messages)};
  UbloxStep check{"read the settings back", {}, kCfg, 0x8B, {}, protocols};
  for (const auto* more : {&rate, &motion, &messages})
    check.settings.insert(check.settings.end(), more->begin(), more->end());
  std::vector<std::uint32_t> keys;
  for (const UbxSetting& setting : check.settings) keys.push_back(setting.key);
  check.request = ubx_valget(keys);
  steps.push_back(std::move(check));
  return steps;
}

// CFG-PRT: 8 bits, no parity, one stop bit; what comes in and goes out.
Bytes m8_port(const UbloxSettings& s) {
  constexpr std::uint16_t kUbx = 1, kNmea = 2, kRtcm3 = 32;
  Bytes p(20);
  p[0] = s.port == UbloxPort::usb ? 3 : 1;
  if (s.port == UbloxPort::uart1) {
    put_little<std::uint32_t>(p, 4, 0x8D0);
    put_little<std::uint32_t>(p, 8, static_cast<std::uint32_t>(s.baud));
  }
  put_little<std::uint16_t>(p, 12, s.corrections ? kUbx | kNmea | kRtcm3 : kUbx | kNmea);
  put_little<std::uint16_t>(p, 14, kUbx);
  return encode_ubx(kCfg, 0x00, p);
}

std::vector<UbloxStep> m8_steps(const UbloxSettings& s) {
  const auto period_ms = static_cast<std::uint16_t>(1000 / s.rate_hz);
  Bytes rate;
  for (const std::uint16_t value : {period_ms, std::uint16_t{1}})
    append_little<std::uint16_t>(rate, value);
  return {{"choose the protocols", m8_port(s), kCfg, 0x00, {}, {}},
          {"set the rate", ubx_cfg_rate(period_ms, 1, 1), kCfg, 0x08, {}, {}},
          {"set the dynamic model", ubx_cfg_nav5_model(s.dynamic_model), kCfg, 0x24, {}, {}},
          {"choose NAV-PVT", ubx_cfg_msg(0x01, 0x07, 1), kCfg, 0x01, {}, {}},
          {"choose NAV-EOE", ubx_cfg_msg(0x01, 0x61, 1), kCfg, 0x01, {}, {}},
          {"read the rate back", encode_ubx(kCfg, 0x08), kCfg, 0x08, rate, {}}};
}

bool holds(const std::vector<UbxSetting>& said, const UbxSetting& wanted) {
  return std::any_of(said.begin(), said.end(), [&](const UbxSetting& setting) {
    return setting.key == wanted.key && setting.value == wanted.value;
  });
}

}  // namespace

std::optional<UbloxModel> ublox_model(const UbxMonVer& version) {
  const auto protocol = whole_real(after(version.extensions, "PROTVER"));
  if (!protocol) return std::nullopt;
  UbloxModel model;
  model.model = after(version.extensions, "MOD");
  model.firmware = after(version.extensions, "FWVER");
  if (model.firmware.empty()) model.firmware = version.software;
  model.hardware = version.hardware;
  model.protocol = *protocol;
  model.dialect = *protocol >= 27 ? UbloxDialect::f9 : UbloxDialect::m8;
  return model;
}

std::string ublox_settings_problem(const UbloxSettings& s) {
  if (s.rate_hz < 1 || s.rate_hz > 20 || 1000 % s.rate_hz != 0)
    return "epochs come at 1, 2, 4, 5, 8, 10 or 20 Hz";
  if (std::find(std::begin(kUbloxBauds), std::end(kUbloxBauds), s.baud) == std::end(kUbloxBauds))
    return "no such bit rate: " + std::to_string(s.baud);
  // NAV-PVT, NAV-HPPOSLLH, NAV-COV, NAV-EOE and, once a second, MON-RF.
  const int bits_per_s = 10 * (s.rate_hz * (100 + 44 + 72 + 12) + 60);
  if (s.port == UbloxPort::uart1 && bits_per_s > s.baud / 10 * 8)
    return std::to_string(s.rate_hz) + " Hz do not fit into " + std::to_string(s.baud) + " baud";
  constexpr std::uint8_t kModels[] = {0, 2, 3, 4, 5, 6, 7, 8};
  if (std::find(std::begin(kModels), std::end(kModels), s.dynamic_model) == std::end(kModels))
    return "no such dynamic model";
  return {};
}

std::vector<UbloxStep> ublox_steps(UbloxDialect dialect, const UbloxSettings& settings) {
  return dialect == UbloxDialect::f9 ? f9_steps(settings) : m8_steps(settings);
}

UbloxAnswer ublox_judge(const UbloxStep& step, const UbxMessage& message) {
  const bool asks = !step.reads_back.empty() || !step.settings.empty();
  if (const auto ack = ubx_ack(message)) {
    if (ack->cls != step.cls || ack->id != step.id) return UbloxAnswer::unrelated;
    if (!ack->accepted) return UbloxAnswer::refused;
    return asks ? UbloxAnswer::unrelated : UbloxAnswer::accepted;
  }
  if (!asks || message.cls != step.cls || message.id != step.id) return UbloxAnswer::unrelated;
  if (!step.settings.empty()) {
    const auto said = ubx_settings(message);
    const bool all = said && std::all_of(step.settings.begin(), step.settings.end(),
                                         [&](const auto& wanted) { return holds(*said, wanted); });
    return all ? UbloxAnswer::accepted : UbloxAnswer::other_value;
  }
  const bool same =
      message.payload.size() >= step.reads_back.size() &&
      std::equal(step.reads_back.begin(), step.reads_back.end(), message.payload.begin());
  return same ? UbloxAnswer::accepted : UbloxAnswer::other_value;
}

}  // namespace drivers
