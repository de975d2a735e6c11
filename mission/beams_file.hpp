// A scan as it was measured, in a file that outlives the program: what a map is filled from anew,
// when poses change and when a run goes on after a cut.
#pragma once

#include <cstdint>
#include <filesystem>

#include "hal/values.hpp"
#include "mission/files.hpp"

namespace mission {

// 80 bytes, and 28 a beam; 4 a beam, and a few for each row and column, where the scan has a fan or
// keeps exactly to its pattern. Durable when it returns: see write_file. Returns the checksum of
// all of it, which also stands in it.
FileResult<std::uint64_t> write_beams(const std::filesystem::path& path,
                                      const hal::ScanCloud& scan);

// Bit for bit what was written. Fails with errc::bad_message for any other file, one that is cut
// short or damaged, and one whose checksum is another.
FileResult<hal::ScanCloud> read_beams(const std::filesystem::path& path, std::uint64_t checksum);

// Whether it is that, without keeping it: a few MB of memory.
FileResult<void> verify_beams(const std::filesystem::path& path, std::uint64_t checksum);

}  // namespace mission
