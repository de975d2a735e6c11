// The console's one password: an argon2id hash in a file of its own. There is no default one.
#pragma once

#include <filesystem>
#include <string>

namespace mission {

class PasswordFile {
 public:
  // Reads what is there. A file that cannot be read, or holds no hash, is a password that nobody
  // knows: it lets nobody in, and is not the same as none.
  explicit PasswordFile(std::filesystem::path path);

  bool exists() const { return exists_; }
  // Why a file that is there is of no use; empty: nothing is wrong.
  const std::string& problem() const { return problem_; }

  // Both take a tenth of a second and 64 MiB, so that guessing is slow: not for the event loop. One
  // at a time.
  bool is(const std::string& password) const;
  // Replaces it, whole, for its owner's eyes only. What went wrong; empty: nothing.
  std::string set(const std::string& password);

 private:
  std::filesystem::path path_;
  bool exists_ = false;
  std::string hash_, problem_;
};

}  // namespace mission
