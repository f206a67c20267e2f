// SPDX-License-Identifier: Apache-2.0
// A visitor of lambdas: std::visit(Overloaded{[](const A&) {...}, [](const B&) {...}}, variant) does not compile while one of the
// variant's types has no lambda.
#pragma once

namespace fbvins {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

}  // namespace fbvins
