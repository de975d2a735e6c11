// Which devices `vantage decode` knows.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/offline.hpp"

namespace decoders {

struct Options {
  std::string metadata;  // The text of the sensor's own description, for devices that need one.
};

struct Device {
  std::string_view name, what;
  bool needs_metadata;
  // May throw std::runtime_error for metadata that cannot be used.
  std::unique_ptr<drivers::OfflineDecoder> (*make)(const Options&);
};

const std::vector<Device>& devices();

// Null for a name that is not in devices().
std::unique_ptr<drivers::OfflineDecoder> make_decoder(std::string_view name,
                                                      const Options& options);

}  // namespace decoders
