#include "mission/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace mission {
namespace {

boost::system::error_code last_error() {
  return {errno, boost::system::system_category()};
}

// Closes when it goes out of scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }
  bool ok() const { return fd_ >= 0; }
  // Closing may be the moment at which a network file system reports a failed write.
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

bool write_and_flush(const std::filesystem::path& part,
                     std::initializer_list<std::string_view> pieces) {
  Descriptor file(file_calls().open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!file.ok()) return false;
  for (const std::string_view piece : pieces)
    if (!write_fully(file.get(), piece)) return false;
  return file_calls().fsync(file.get()) == 0 && file.close();
}

bool flush_folder(const std::filesystem::path& folder) {
  const Descriptor opened(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!opened.ok()) return false;
  // Some file systems cannot flush a folder; there the rename is as durable as it gets.
  return file_calls().fsync(opened.get()) == 0 || errno == EINVAL || errno == ENOTSUP;
}

FileCalls* calls_set = nullptr;

}  // namespace

int FileCalls::open(const char* path, int flags, unsigned mode) {
  return ::open(path, flags, mode);
}

std::ptrdiff_t FileCalls::write(int fd, const void* bytes, std::size_t count) {
  return ::write(fd, bytes, count);
}

std::ptrdiff_t FileCalls::pwrite(int fd, const void* bytes, std::size_t count, std::int64_t at) {
  return ::pwrite(fd, bytes, count, at);
}

int FileCalls::fsync(int fd) {
  return ::fsync(fd);
}

int FileCalls::ftruncate(int fd, std::int64_t bytes) {
  return ::ftruncate(fd, bytes);
}

int FileCalls::rename(const char* from, const char* to) {
  return ::rename(from, to);
}

int FileCalls::unlink(const char* path) {
  return ::unlink(path);
}

std::int64_t FileCalls::bytes_free(const char* folder) {
  std::error_code unknown;
  const auto space = std::filesystem::space(folder, unknown);
  return unknown ? -1 : static_cast<std::int64_t>(space.available);
}

FileCalls& file_calls() {
  static FileCalls system;
  return calls_set == nullptr ? system : *calls_set;
}

void set_file_calls(FileCalls* calls) {
  calls_set = calls;
}

bool write_fully(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const std::ptrdiff_t wrote = file_calls().write(fd, bytes.data(), bytes.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return false;
    if (wrote == 0) {  // Would go on for ever.
      errno = ENOSPC;
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(wrote));
  }
  return true;
}

std::string FileError::text() const {
  const std::string why = detail.empty() ? code.message() : detail;
  return fmt::format("cannot {} {}: {}", doing, path.string(), why);
}

void throw_exception_from_error(const FileError& error, const boost::source_location&) {
  throw FileFailure(error);
}

std::filesystem::path part_name(const std::filesystem::path& path) {
  return path.parent_path() / ("." + path.filename().string() + ".part");
}

FileResult<void> write_file(const std::filesystem::path& path,
                            std::initializer_list<std::string_view> pieces) {
  const auto part = part_name(path);
  if (!write_and_flush(part, pieces) || file_calls().rename(part.c_str(), path.c_str()) != 0) {
    const auto code = last_error();
    file_calls().unlink(part.c_str());
    return FileError{path, "write", code};
  }
  if (!flush_folder(path.parent_path())) return FileError{path, "write", last_error()};
  return {};
}

FileResult<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.ok()) return FileError{path, "read", last_error()};
  std::string bytes;
  struct stat status {};
  if (::fstat(file.get(), &status) == 0 && status.st_size > 0) {
    bytes.reserve(std::min(max_bytes, static_cast<std::size_t>(status.st_size)) + 1);
  }
  constexpr std::size_t kStep = std::size_t{1} << 20;
  while (true) {
    const std::size_t had = bytes.size();
    bytes.resize(std::max(bytes.capacity(), had + kStep));
    const ssize_t got = ::read(file.get(), bytes.data() + had, bytes.size() - had);
    if (got < 0 && errno != EINTR) return FileError{path, "read", last_error()};
    bytes.resize(had + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got == 0) return bytes;
    if (bytes.size() > max_bytes) {
      return FileError{path, "read", make_error_code(boost::system::errc::file_too_large)};
    }
  }
}

}  // namespace mission
