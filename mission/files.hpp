// Files that are either whole or not there, and errors that name the file.
#pragma once

#include <boost/system/error_code.hpp>
#include <boost/system/result.hpp>
#include <boost/system/system_error.hpp>
#include <cstddef>
#include <cstdint>
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
// Its bytes are not what such a file holds.
inline FileError unreadable(const std::filesystem::path& path, std::string detail) {
  return {path, "read", make_error_code(boost::system::errc::bad_message), std::move(detail)};
}

template <class T>
using FileResult = boost::system::result<T, FileError>;

// What FileResult::value() throws: a system_error that says what the error says.
class FileFailure : public boost::system::system_error {
 public:
  explicit FileFailure(const FileError& error)
      : system_error(error.code), error_(error), text_(error.text()) {}
  const FileError& error() const { return error_; }
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  FileError error_;
  std::string text_;
};
[[noreturn]] void throw_exception_from_error(const FileError& error,
                                             const boost::source_location& where);

// The system's calls that change files: the one way to them, so that tests can break any of them or
// watch their order. As the system's: -1 and errno, or fewer bytes than asked for.
struct FileCalls {
  FileCalls() = default;
  FileCalls(const FileCalls&) = delete;
  FileCalls& operator=(const FileCalls&) = delete;
  virtual ~FileCalls() = default;
  virtual int open(const char* path, int flags, unsigned mode);
  virtual std::ptrdiff_t write(int fd, const void* bytes, std::size_t count);
  virtual std::ptrdiff_t pwrite(int fd, const void* bytes, std::size_t count, std::int64_t at);
  virtual int fsync(int fd);
  virtual int ftruncate(int fd, std::int64_t bytes);
  virtual int rename(const char* from, const char* to);
  virtual int unlink(const char* path);
  virtual std::int64_t bytes_free(const char* folder);  // To this user; -1: unknown.
};
FileCalls& file_calls();
// For the whole program, before threads use it; null: the system's. It must outlive its use.
void set_file_calls(FileCalls* calls);

// Writes all of it at the descriptor's place. False: errno says why.
bool write_fully(int fd, std::string_view bytes);

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
