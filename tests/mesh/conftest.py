"""One mesh cache for the tests of this folder, away from the user's."""

import pytest


@pytest.fixture(autouse=True, scope="package")
def mesh_cache(tmp_path_factory: pytest.TempPathFactory) -> object:
    """Points ``CONOID_CACHE_DIR`` to an empty folder while these tests run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CONOID_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield
