"""A mesh cache for the tests of tests/mesh, separate from the cache of the user."""

import pytest

from conoid.worker.kernels.store import cache_folder


@pytest.fixture(autouse=True, scope="package")
def mesh_cache(tmp_path_factory: pytest.TempPathFactory) -> object:
    """Sets ``CONOID_CACHE_DIR`` to an empty folder while the mesh tests run; the folder of the compiled kernels does
    not change.
    """
    folder, kernels = tmp_path_factory.mktemp("cache"), cache_folder().parent
    (folder / kernels.name).symlink_to(kernels)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CONOID_CACHE_DIR", str(folder))
        yield
