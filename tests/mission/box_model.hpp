// An OBJ model of flat ground with boxes on it, and who was scanned there.
#pragma once

#include <set>
#include <string>

#include "mission/record.hpp"

namespace mission_test {

class BoxModel {
 public:
  // Metres; the top is closed.
  void add(double x0_m, double y0_m, double x1_m, double y1_m, double height_m) {
    const double xs[] = {x0_m, x1_m, x1_m, x0_m}, ys[] = {y0_m, y0_m, y1_m, y1_m};
    for (const double z : {0.0, height_m})
      for (int i = 0; i < 4; ++i)
        text_ += "v " + std::to_string(xs[i]) + " " + std::to_string(ys[i]) + " " +
                 std::to_string(z) + "\n";
    for (int i = 0; i < 4; ++i) {
      add_face(i, (i + 1) % 4, (i + 1) % 4 + 4);
      add_face(i, (i + 1) % 4 + 4, i + 4);
    }
    add_face(4, 5, 6);
    add_face(4, 6, 7);
    corner_ += 8;
  }
  const std::string& text() const { return text_; }

 private:
  void add_face(int a, int b, int c) {
    text_ += "f " + std::to_string(corner_ + a) + " " + std::to_string(corner_ + b) + " " +
             std::to_string(corner_ + c) + "\n";
  }

  std::string text_ = "v -40 -40 0\nv 80 -40 0\nv 80 50 0\nv -40 50 0\nf 1 2 3\nf 1 3 4\n";
  int corner_ = 5;
};

inline std::multiset<std::string> scanned(const mission::RunRecord& record) {
  std::multiset<std::string> names;
  for (const mission::ScanRecord& scan : record.scans) names.insert(scan.name);
  return names;
}

}  // namespace mission_test
