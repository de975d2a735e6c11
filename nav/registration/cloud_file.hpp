// Reads clouds that other programs wrote: PLY (ascii, binary of either byte order), PCD (ascii,
// binary, binary_compressed), and text (CSV, XYZ). From the bytes of a file to points.
#pragma once

#include <boost/system/result.hpp>
#include <string>
#include <string_view>

#include "nav/registration/cloud.hpp"

namespace nav {

// What is wrong, where, and what to do about it.
struct CloudError {
  std::string file;
  int line{};  // 0 where the place is not a line of text.
  std::string what;

  std::string text() const;  // "FILE:LINE: what"
};
template <class T>
using CloudResult = boost::system::result<T, CloudError>;
[[noreturn]] void throw_exception_from_error(const CloudError& error,
                                             const boost::source_location& where);

// Whatever it looks like: "ply" or a PCD header at the front, else text. All points of the file, in
// its order, also those that are not finite (see usable_points); an empty cloud is an error.
// Text: three numbers a line, split by blanks, commas or semicolons; a header may name the columns;
// lines that start with # or // are left out.
CloudResult<Points> parse_cloud(std::string_view bytes, std::string_view file);

CloudResult<Points> parse_ply_cloud(std::string_view bytes, std::string_view file);
CloudResult<Points> parse_pcd_cloud(std::string_view bytes, std::string_view file);
CloudResult<Points> parse_text_cloud(std::string_view bytes, std::string_view file);

}  // namespace nav
