// Files that are either whole or not there, and errors that name the file.
#pragma once

#include <boost/system/error_code.hpp>
#include <boost/system/result.hpp>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

namespace mission {

// What could not be done to which file. `detail` says more where the code alone would not help.
struct FileError {
  FileError() = default;
  FileError(std::filesystem::path file, std::string verb, boost::system::error_code why,
            std::string more = {})
      : path(std::move(file)), doing(std::move(verb)), code(why), detail(std::move(more)) {}

  std::filesystem::path path;
  std::string doing;  // "write", "read", ...
  boost::system::error_code code;
  std::string detail;

  std::string text() const;  // "cannot write runs/7/map.ot: No space left on device"
};

template <class T>
using FileResult = boost::system::result<T, FileError>;

// What FileResult::value() throws: boost::system::system_error with the error's text.
[[noreturn]] void throw_exception_from_error(const FileError& error,
                                             const boost::source_location& where);

// Writes the pieces one after the other to a temporary name beside `path`, flushes it to the disk,
// renames it and flushes the folder: after a power cut `path` holds the old bytes or the new ones,
// whole. Leaves nothing behind when it fails.
FileResult<void> write_file(const std::filesystem::path& path,
                            std::initializer_list<std::string_view> pieces);

// The whole file, at most max_bytes of it: a larger file is an error (file_too_large).
FileResult<std::string> read_file(const std::filesystem::path& path,
                                  std::size_t max_bytes = std::size_t{1} << 31);

// The name write_file uses until the file is whole: ".NAME.part" in the same folder.
std::filesystem::path part_name(const std::filesystem::path& path);

}  // namespace mission
