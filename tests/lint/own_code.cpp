// A plugin of clang-tidy: its checks go through the project's own declarations alone. Without it they also go through
// every system header that a unit includes, only to keep silent about it, which takes as long as reading the unit.
// ./dev lint compiles and loads it.
#include <vector>

#include <clang-tidy/ClangTidyCheck.h>
#include <clang-tidy/ClangTidyModule.h>
#include <clang-tidy/ClangTidyModuleRegistry.h>
#include <clang/AST/ASTContext.h>
#include <clang/ASTMatchers/ASTMatchFinder.h>

namespace {

/// Reports nothing. A unit is matched before what is in it, so that what is set here holds for all checks.
class OwnCode final : public clang::tidy::ClangTidyCheck {
 public:
  using ClangTidyCheck::ClangTidyCheck;

  void registerMatchers(clang::ast_matchers::MatchFinder* finder) override {
    finder->addMatcher(clang::ast_matchers::translationUnitDecl().bind("unit"), this);
  }

  void check(const clang::ast_matchers::MatchFinder::MatchResult& result) override {
    std::vector<clang::Decl*> own;
    // What comes from a precompiled header is a system header's, and is not even read for this.
    for (clang::Decl* declaration : result.Nodes.getNodeAs<clang::TranslationUnitDecl>("unit")->noload_decls()) {
      const clang::SourceLocation where = declaration->getLocation();
      if (where.isValid() && !result.SourceManager->isInSystemHeader(where)) own.push_back(declaration);
    }
    result.Context->setTraversalScope(own);
  }
};

class Module final : public clang::tidy::ClangTidyModule {
 public:
  void addCheckFactories(clang::tidy::ClangTidyCheckFactories& factories) override {
    factories.registerCheck<OwnCode>("pneuma-own-code");
  }
};

const clang::tidy::ClangTidyModuleRegistry::Add<Module> registered("pneuma", "The project's own declarations alone");

}  // namespace
