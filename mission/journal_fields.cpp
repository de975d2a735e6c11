#include "mission/journal_fields.hpp"

#include "mission/faults.hpp"

namespace mission {
namespace {

constexpr int kError = 3, kWarning = 4, kNotice = 5, kInfo = 6;

struct Kind {
  std::string_view begins;
  std::string_view id;
};
constexpr Kind kKinds[] = {
    {"the robot is stopped: ", message_id::kStopped},
    {"the robot was released", message_id::kReleased},
    {"hangs: ", message_id::kHangs},
    {"the robot stands, because it misses ", message_id::kDevices},
    {"all devices are back ", message_id::kDevices},
};

const Kind* kind_of(std::string_view text) {
  for (const Kind& kind : kKinds)
    if (text.starts_with(kind.begins)) return &kind;
  return nullptr;
}

const FaultEntry* first_fault(std::string_view text) {
  const FaultEntry* first = nullptr;
  std::size_t first_at = std::string_view::npos;
  for (const FaultEntry& fault : all_faults()) {
    const std::size_t at = text.find(fault.id);
    if (at >= first_at) continue;
    first = &fault;
    first_at = at;
  }
  return first;
}

int priority_of(const FaultEntry* fault, const Kind* kind) {
  if (kind != nullptr && kind->id == message_id::kReleased) return kNotice;
  if (fault == nullptr) return kInfo;
  if (fault->action == Action::stop) return kError;
  return fault->action >= Action::home ? kWarning : kNotice;
}

}  // namespace

std::vector<std::string> journal_fields(std::string_view text) {
  const FaultEntry* fault = first_fault(text);
  const Kind* kind = kind_of(text);
  std::vector<std::string> fields{"MESSAGE=" + std::string(text),
                                  "PRIORITY=" + std::to_string(priority_of(fault, kind))};
  if (fault != nullptr) fields.push_back("FAULT_ID=" + std::string(fault->id));
  if (kind != nullptr) fields.push_back("MESSAGE_ID=" + std::string(kind->id));
  return fields;
}

}  // namespace mission
