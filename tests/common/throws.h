#pragma once

#include <gtest/gtest.h>

#include <exception>
#include <string>

namespace dexcheck::testing {

/// Success when calling `function` throws ErrorType and the message contains `text`: an error must name the
/// quantity that is wrong.
template <typename ErrorType, typename Function>
::testing::AssertionResult Throws(const Function& function, const std::string& text) {
  try {
    static_cast<void>(function());
  } catch (const ErrorType& error) {
    const std::string message = error.what();
    if (message.find(text) != std::string::npos) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "message \"" << message << R"(" lacks ")" << text << "\"";
  } catch (const std::exception& error) {
    return ::testing::AssertionFailure() << "another error: " << error.what();
  }
  return ::testing::AssertionFailure() << "nothing was thrown";
}

/// Message of the exception of this type that the function throws; "accepted" when it throws none.
template <typename ErrorType, typename Function>
std::string MessageOf(const Function& function) {
  try {
    static_cast<void>(function());
  } catch (const ErrorType& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace dexcheck::testing
