#include "mission/password.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "mission/files.hpp"

namespace mission {
namespace {

constexpr unsigned long long kWork = crypto_pwhash_OPSLIMIT_INTERACTIVE;
constexpr std::size_t kMemory = crypto_pwhash_MEMLIMIT_INTERACTIVE;
constexpr std::size_t kPasswordFileMax = 1024;

bool sodium_ready() {
  static const bool ready = sodium_init() >= 0;
  return ready;
}

}  // namespace

PasswordFile::PasswordFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code ignored;
  const auto status = std::filesystem::symlink_status(path_, ignored);
  if (status.type() == std::filesystem::file_type::not_found) return;
  exists_ = true;
  auto read = read_file(path_, kPasswordFileMax);
  if (!read) {
    problem_ = read.error().text();
    return;
  }
  hash_ = std::move(*read);
  while (hash_.ends_with('\n')) hash_.pop_back();
  if (hash_.starts_with("$argon2id$") && hash_.size() < crypto_pwhash_STRBYTES) return;
  problem_ = path_.string() + " holds no argon2id hash: remove it to set a password anew";
  hash_.clear();
}

bool PasswordFile::is(const std::string& password) const {
  if (!sodium_ready() || hash_.empty()) return false;
  return crypto_pwhash_str_verify(hash_.c_str(), password.data(), password.size()) == 0;
}

std::string PasswordFile::set(const std::string& password) {
  if (!sodium_ready()) return "no source of random numbers";
  std::array<char, crypto_pwhash_STRBYTES> hash{};
  if (crypto_pwhash_str_alg(hash.data(), password.data(), password.size(), kWork, kMemory,
                            crypto_pwhash_ALG_ARGON2ID13) != 0)
    return "not enough memory to hash the password: nothing was changed";
  // Made first with its rights, so that nobody can read it before they are set.
  const auto part = part_name(path_);
  const int made = ::open(part.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (made < 0) return FileError(path_, "write", {errno, boost::system::system_category()}).text();
  const bool closed_to_others = ::fchmod(made, 0600) == 0;
  ::close(made);
  if (!closed_to_others) return fmt::format("cannot set the rights of {}", part.string());
  const auto written = write_file(path_, {hash.data(), "\n"});
  if (!written) return written.error().text();
  hash_ = hash.data();
  exists_ = true;
  problem_.clear();
  return {};
}

}  // namespace mission
