// What can be wrong with two CiA 402 drives, in words.
#include "drivers/cia402_drive.hpp"
#include "drivers/cia402_times.hpp"

namespace drivers {

using namespace cia402_times;
namespace errc = boost::system::errc;

namespace {

using namespace std::chrono_literals;

// In the order of `Which`.
constexpr Fault kFaults[] = {
    {1, "drive silent", "no power, cable loose, or another node id or bit rate is set",
     "check its supply and CAN plug; compare node id and bit rate with the robot file"},
    {2, "nobody acknowledges on the bus", "both drives off, cable loose or not terminated",
     "switch the drives on; check CAN-H, CAN-L and the two 120 ohm terminations"},
    {3, "CAN bus down", "wrong bit rate, a short circuit, or the adapter was unplugged",
     "set the drives' bit rate (500 kbit/s); check CAN-H against CAN-L; plug the adapter in"},
    {4, "another device or master on the bus", "wrong CAN channel, or two programs command",
     "check which channel the drives hang on; end the other program"},
    {5, "not a CiA 402 drive", "another CANopen device has this node id",
     "compare the node ids with the robot file"},
    {6, "another drive than expected", "it was exchanged, or the node ids are",
     "compare vendor and product with the robot file or its EDS"},
    {7, "drive does not have this velocity mode", "object 0x6502 does not list it",
     "choose a mode that it has in the robot file"},
    {8, "EDS does not fit", "the drive's EDS lacks what is needed, or is another drive's",
     "take the EDS of this drive and firmware"},
    {9, "drive refuses a setting", "see the code", "compare with the drive's manual"},
    {10, "drive does not keep a setting", "it reads back differently",
     "compare with the drive's manual: units, limits, a lock"},
    {11, "drive does not start", "it got the start command but stays pre-operational",
     "read its error history; restart it"},
    {12, "drive does not enable its power stage", "no motor power, or its STO input is open",
     "release the e-stop; check motor supply and STO wiring"},
    {13, "drive's fault persists", "it came back after each reset",
     "clear the cause, then switch the drive off and on"},
    {14, "drive stopped reporting", "bus overloaded, or its mapping was changed",
     "check the bus load and who else configures the drive"},
    {15, "reports are missing", "bus overloaded or disturbed, or the drive is slow",
     "check cable and terminations, and what else sends on the bus"},
    {16, "reports doubled or out of order", "two drives with one node id, or a bridge",
     "check the node ids; take the bridge out"},
    {17, "unreadable messages", "another device uses the drive's ids, or a disturbed bus",
     "check what else sends on the bus, and the cable"},
    {18, "drive answers late", "a slow bridge, or a bus that is overloaded",
     "connect the drives directly; lower the load on the bus"},
    {19, "drive does not answer questions", "its heart beats, but its SDO server is stuck",
     "switch the drive off and on"},
    {20, "position jumped", "another device uses its ids, or its encoder fails",
     "check what else sends on the bus, and the encoder cable"},
    {21, "position and speed disagree", "wrong scale, a slipping coupling or a bad encoder",
     "drive a measured metre; compare counts_per_m and units_per_mps"},
    {22, "drive warns", "bit 7 of its statusword: near a limit", "see its error register"},
    {23, "way blocked", "the wheels stand though they are told to turn",
     "free the robot; see whether something blocks its wheels"},
    {24, "drive's fixed PDO mapping does not do",
     "its mapping cannot be written, and has not what is needed",
     "take a drive or firmware whose PDOs can be mapped, or whose own hold these objects"},
};

std::string milliseconds(hal::Duration span) {
  return std::to_string(span / 1ms) + " ms";
}

std::string hex(std::uint32_t value) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text = "0x";
  for (int shift = value > 0xFFFF ? 28 : 12; shift >= 0; shift -= 4)
    text += kDigits[value >> shift & 0xF];
  return text;
}

bool within(hal::Time at, hal::Time now, hal::Duration span) {
  return at != hal::Time{} && now - at <= span;
}

}  // namespace

std::span<const Fault> Cia402Drive::faults() const {
  return kFaults;
}

std::string Cia402Drive::who(const Node& node, const std::string& what) const {
  std::string text = std::string(node.name) + " drive, node " + std::to_string(node.side.node);
  if (!what.empty()) text += ": " + what;
  return text;
}

// Whom one could mean, when a node is silent.
std::string Cia402Drive::others() const {
  std::string text;
  for (unsigned id = 1; id < heard_nodes_.size(); ++id) {
    if (!heard_nodes_.test(id) || id == left_.side.node || id == right_.side.node) continue;
    text += (text.empty() ? "heard node " : ", ") + std::to_string(id);
  }
  return text;
}

std::vector<Trouble> Cia402Drive::troubles() const {
  std::vector<Trouble> all;
  if (!started_) return all;
  const hal::Time now = clock_.now();
  add_bus_troubles(all, now);
  for (const Node* node : {&left_, &right_}) {
    if (all.empty() || within(node->heard.heartbeat_at, now, kListening))
      add_node_troubles(all, *node, now);
    add_report_troubles(all, *node, now);
  }
  if (odometer_.doubtful()) all.push_back({&kFaults[kJumped], {}});
  if (way_.blocked()) all.push_back({&kFaults[kBlocked], {}});
  return all;
}

void Cia402Drive::add_bus_troubles(std::vector<Trouble>& all, hal::Time now) const {
  if (strangers_ >= kStrangers && within(stranger_at_, now, kListening))
    all.push_back({&kFaults[kStranger], "it sends " + hex(stranger_id_)});
  const bool quiet = !beats(left_, now) && !beats(right_, now);
  if (!quiet) return;
  if (receive_error_ || send_error_ == errc::network_down)
    all.push_back({&kFaults[kBusDown], (receive_error_ ? receive_error_ : send_error_).message()});
  else if (send_error_ == errc::timed_out)
    all.push_back({&kFaults[kNoAck], {}});
}

void Cia402Drive::add_node_troubles(std::vector<Trouble>& all, const Node& node,
                                    hal::Time now) const {
  const auto add = [&](Which which, const std::string& what = {}) {
    all.push_back({&kFaults[which], who(node, what)});
  };
  if (node.failure) {
    all.push_back(*node.failure);
  } else if (!beats(node, now) && now - started_at_ > kListening) {
    add(kSilent, node.heard.heartbeat_at == hal::Time{}
                     ? others()
                     : "no heartbeat for " + milliseconds(now - node.heard.heartbeat_at));
  }
  if (node.heard.emergency != 0)
    all.push_back({&canopen::emergency_entry(node.heard.emergency),
                   who(node, "code " + hex(node.heard.emergency))});
  if (node.heard.emergency == 0)
    for (const Fault* fault :
         faults_set(canopen::error_register_faults(), node.heard.error_register))
      all.push_back({fault, who(node)});
  if (!node.configured) return;
  if (node.deaf) add(kDeaf);
  if (node.heard.statusword && !reports(node, now)) add(kReportsStale);
  const auto state = state_of(node);
  if (!state) return;
  if (*state == cia402::State::fault && node.resets >= kResetsMax && !node.resetting)
    add(kPersists);
  if (node.enabling_since != hal::Time{} && now - node.enabling_since > kEnablingMax &&
      *state != cia402::State::fault)
    add(kNotEnabled, "stays in " + std::string(name(*state)));
  if (cia402::status_of(*node.heard.statusword).warning) add(kWarning);
}

void Cia402Drive::add_report_troubles(std::vector<Trouble>& all, const Node& node,
                                      hal::Time now) const {
  const Reports& heard = node.heard;
  const auto add = [&](Which which, const std::string& what = {}) {
    all.push_back({&kFaults[which], who(node, what)});
  };
  if (within(heard.missed_at, now, kRemembered)) add(kMissed);
  if (within(heard.doubled_at, now, kRemembered)) add(kDoubled);
  if (within(heard.unread_at, now, kRemembered)) add(kUnread, std::string(heard.unread_why));
  if (node.watch.agreement.disagree()) add(kDisagree);
  if (node.answer_took > kAnswerLate && beats(node, now))
    add(kLate, "after " + milliseconds(node.answer_took));
}

}  // namespace drivers
