#include "mission/account.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "mission/files.hpp"

namespace mission {
namespace {

constexpr std::size_t kFileMax = 1024;

std::string rights_problem(const std::filesystem::path& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return path.string() + " is not there";
  if (!S_ISREG(status.st_mode)) return path.string() + " is no file";
  if ((status.st_mode & 077U) != 0)
    return fmt::format("others may read {}: do `chmod 600 {}`", path.string(), path.string());
  if (status.st_uid != geteuid() && status.st_uid != 0)
    return fmt::format("{} belongs to another user: do `chown $USER {}`", path.string(),
                       path.string());
  return {};
}

}  // namespace

Account read_account(const std::filesystem::path& path) {
  Account account;
  account.problem = rights_problem(path);
  if (!account.problem.empty()) return account;
  auto text = read_file(path, kFileMax);
  if (!text) {
    account.problem = text.error().text();
    return account;
  }
  while (text->ends_with('\n') || text->ends_with('\r')) text->pop_back();
  const auto colon = text->find(':');
  if (colon == std::string::npos || colon == 0 || text->find('\n') != std::string::npos) {
    account.problem = path.string() + " must be one line, USER:PASSWORD";
    return account;
  }
  account.user = text->substr(0, colon);
  account.password = text->substr(colon + 1);
  return account;
}

}  // namespace mission
