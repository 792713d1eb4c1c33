// Stands for somebody else's program: it has the installed headers and the installed library, nothing of this tree.
#include <cdprcal/version.hpp>

#include <iostream>

int main() { std::cout << "cdprcal " << cdprcal::version << '\n'; }
