// Who we are to somebody else's server: a user and a password, in a file that nobody else may read.
#pragma once

#include <filesystem>
#include <string>

namespace mission {

struct Account {
  std::string user, password;
  std::string problem;  // Why there are none; never with what the file holds. Empty: nothing.
};

// One line, USER:PASSWORD. The file must belong to whoever runs this program, or to root, and give
// no rights to anybody else.
Account read_account(const std::filesystem::path& path);

}  // namespace mission
