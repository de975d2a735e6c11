// Makes the sites that ship with Vantage: map, model and README of each.
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tools/make_sites_site.hpp"

namespace {

constexpr std::string_view kUsage =
    "Usage: make_sites OUTDIR          write every site below OUTDIR\n"
    "       make_sites --check OUTDIR  compare instead of writing; exit 1 when a file differs\n"
    "Example: make_sites configs/sites\n";

sites::Files make_all() {
  std::vector<sites::Site> all;
  all.push_back(sites::make_fort());
  all.push_back(sites::make_tower());
  all.push_back(sites::make_courtyard());
  all.push_back(sites::make_church());
  all.push_back(sites::make_museum());
  sites::Files files{{"README.md", sites::sites_readme(all)}};
  for (const sites::Site& site : all) sites::write_site(site, files);
  return files;
}

void write(const std::filesystem::path& folder, const sites::Files& files) {
  for (const auto& [name, content] : files) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream out(folder / name, std::ios::binary);
    out << content;
    if (!out.flush()) throw std::runtime_error((folder / name).string() + ": cannot be written");
  }
}

// Names every file that differs; returns how many.
int check(const std::filesystem::path& folder, const sites::Files& files) {
  int different = 0;
  for (const auto& [name, content] : files) {
    std::ifstream in(folder / name, std::ios::binary);
    const std::string found{std::istreambuf_iterator<char>(in), {}};
    if (in && found == content) continue;
    ++different;
    fmt::print(stderr, "{}: {}; run make_sites {} and commit the result\n",
               (folder / name).string(), in ? "differs from what make_sites makes" : "is missing",
               folder.string());
  }
  return different;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string_view> arguments(argv + 1, argv + argc);
  if (arguments.size() == 1 && (arguments[0] == "--help" || arguments[0] == "-h")) {
    fmt::print("{}", kUsage);
    return 0;
  }
  const bool checking = !arguments.empty() && arguments[0] == "--check";
  if (arguments.size() != (checking ? 2U : 1U) || arguments.back().starts_with("-")) {
    fmt::print(stderr, "{}", kUsage);
    return 2;
  }
  try {
    const sites::Files files = make_all();
    if (checking) return check(arguments.back(), files) == 0 ? 0 : 1;
    write(arguments.back(), files);
  } catch (const std::exception& error) {
    fmt::print(stderr, "make_sites: {}\n", error.what());
    return 2;
  }
  return 0;
}
