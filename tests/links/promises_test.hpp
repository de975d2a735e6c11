// One gtest per promise and implementation.
#pragma once

#include <gtest/gtest.h>

#include "tests/links/promises/promises.hpp"

namespace links_test {

template <class Rig>
using MakeRig = std::function<std::unique_ptr<Rig>()>;

template <class Rig>
class PromiseTest : public testing::Test {
 public:
  PromiseTest(MakeRig<Rig> make, Promise<Rig> promise)
      : make_(std::move(make)), promise_(promise) {}

  void TestBody() override {
    const auto rig = make_();
    try {
      rig->loop().run(promise_.keep(*rig));
    } catch (const Broken& broken) {
      FAIL() << broken.what();
    } catch (const Skipped& skipped) {
      GTEST_SKIP() << skipped.what();
    }
  }

 private:
  MakeRig<Rig> make_;
  Promise<Rig> promise_;
};

// To be called before the tests run: from an initializer.
template <class Rig>
bool hold(const std::string& implementation, std::span<const Promise<Rig>> promises,
          const MakeRig<Rig>& make) {
  for (const Promise<Rig>& promise : promises)
    testing::RegisterTest(
        implementation.c_str(), std::string(promise.name).c_str(), nullptr, nullptr, __FILE__,
        __LINE__, [=]() -> PromiseTest<Rig>* { return new PromiseTest<Rig>(make, promise); });
  return true;
}

}  // namespace links_test
