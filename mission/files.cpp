#include "mission/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <boost/system/system_error.hpp>
#include <cerrno>
#include <vector>

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

bool write_all(int fd, std::vector<iovec> pieces) {
  std::size_t first = 0;
  while (first < pieces.size()) {
    const ssize_t wrote = ::writev(fd, &pieces[first], static_cast<int>(pieces.size() - first));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return false;
    auto left = static_cast<std::size_t>(wrote);
    while (first < pieces.size() && left >= pieces[first].iov_len) left -= pieces[first++].iov_len;
    if (first == pieces.size()) break;
    pieces[first].iov_base = static_cast<char*>(pieces[first].iov_base) + left;
    pieces[first].iov_len -= left;
  }
  return true;
}

bool write_and_flush(const std::filesystem::path& part,
                     std::initializer_list<std::string_view> pieces) {
  Descriptor file(::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!file.ok()) return false;
  std::vector<iovec> vectors;
  for (const std::string_view piece : pieces) {
    if (!piece.empty()) vectors.push_back({const_cast<char*>(piece.data()), piece.size()});
  }
  return write_all(file.get(), std::move(vectors)) && ::fsync(file.get()) == 0 && file.close();
}

bool flush_folder(const std::filesystem::path& folder) {
  const Descriptor opened(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!opened.ok()) return false;
  // Some file systems cannot flush a folder; there the rename is as durable as it gets.
  return ::fsync(opened.get()) == 0 || errno == EINVAL || errno == ENOTSUP;
}

}  // namespace

std::string FileError::text() const {
  const std::string why = detail.empty() ? code.message() : detail;
  return fmt::format("cannot {} {}: {}", doing, path.string(), why);
}

void throw_exception_from_error(const FileError& error, const boost::source_location&) {
  throw boost::system::system_error(error.code, error.text());
}

std::filesystem::path part_name(const std::filesystem::path& path) {
  return path.parent_path() / ("." + path.filename().string() + ".part");
}

FileResult<void> write_file(const std::filesystem::path& path,
                            std::initializer_list<std::string_view> pieces) {
  const auto part = part_name(path);
  if (!write_and_flush(part, pieces) || ::rename(part.c_str(), path.c_str()) != 0) {
    const auto code = last_error();
    ::unlink(part.c_str());
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
