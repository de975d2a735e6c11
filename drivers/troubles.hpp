// What is wrong with a device now, in the order in which it showed.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "drivers/device.hpp"

namespace drivers {

// One entry for each fault of a static table.
class Troubles {
 public:
  void set(const Fault& fault, std::string detail = {}) {
    const auto at = find(fault);
    if (at == all_.end())
      all_.push_back({&fault, std::move(detail)});
    else
      at->detail = std::move(detail);
  }
  void clear(const Fault& fault) {
    if (const auto at = find(fault); at != all_.end()) all_.erase(at);
  }
  void set_if(bool present, const Fault& fault, std::string detail = {}) {
    present ? set(fault, std::move(detail)) : clear(fault);
  }
  void clear() { all_.clear(); }
  bool has(const Fault& fault) const {
    return std::any_of(all_.begin(), all_.end(),
                       [&](const Trouble& trouble) { return trouble.fault == &fault; });
  }

  const std::vector<Trouble>& all() const { return all_; }

 private:
  std::vector<Trouble>::iterator find(const Fault& fault) {
    return std::find_if(all_.begin(), all_.end(),
                        [&](const Trouble& trouble) { return trouble.fault == &fault; });
  }

  std::vector<Trouble> all_;
};

}  // namespace drivers
