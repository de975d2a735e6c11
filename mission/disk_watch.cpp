#include "mission/disk_watch.hpp"

#include "mission/disk_fault.hpp"

namespace mission {

bool DiskWatch::failed(Part part, const FileError& why, hal::Time now) {
  const bool was_well = well();
  if (was_well) since_ = now;
  of(part) = why;
  return was_well;
}

bool DiskWatch::works(Part part) {
  const bool was_well = well();
  of(part).reset();
  return !was_well && well();
}

std::optional<FaultCode> DiskWatch::fault() const {
  if (well()) return std::nullopt;
  return disk_fault((files_ ? files_ : journal_)->code);
}

std::string DiskWatch::text() const {
  return well() ? std::string() : fault_text(files_ ? *files_ : *journal_);
}

std::string DiskWatch::why() const {
  return well() ? std::string() : (files_ ? *files_ : *journal_).text();
}

DiskWatch::Answer DiskWatch::answer(hal::Time now) const {
  if (goes_home_) return Answer::goes_home;
  if (well()) return Answer::goes_on;
  if (!given_up(now)) return Answer::stands;
  return then_home_ ? Answer::goes_home : Answer::ends;
}

}  // namespace mission
